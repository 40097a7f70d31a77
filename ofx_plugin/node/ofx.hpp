// The OpenFX interface, and the names that older SDKs do not have yet.
#pragma once

#include "ofxCore.h"
#include "ofxImageEffect.h"
#include "ofxMessage.h"
#include "ofxMultiThread.h"
#include "ofxParam.h"
#include "ofxProperty.h"

// From OFX 1.4 (with GPU rendering, whose header needs nothing else from us) and OFX 1.5.1.
#ifndef kOfxImageEffectPropCPURenderSupported
#define kOfxImageEffectPropCPURenderSupported "OfxImageEffectPropCPURenderSupported"
#endif
#ifndef kOfxImageEffectPropNoSpatialAwareness
#define kOfxImageEffectPropNoSpatialAwareness "OfxImageEffectPropNoSpatialAwareness"
#endif

// From Nuke's extension, which Natron knows too: the next parameter stays on this one's row.
#define kOfxParamPropLayoutHint "OfxParamPropLayoutHint"
#define kOfxParamPropLayoutHintNoNewLine 2

// DaVinci Resolve's: of the effect instance, the media's file (of a sequence its first); of the
// render action's arguments, the frame of that media, an index from 0.
#define kResolvePropSrcFilePath "OfxImageEffectPropSrcFilePath"
#define kResolvePropSrcFrame "OfxImageEffectPropSrcFrame"

// From OFX 1.5: headers of older SDKs lack all of it, and those of newer ones bring a configuration
// of some thousand lines along that is not needed here.
#if defined(__has_include)
#if __has_include("ofxColour.h")
#define OFX_NO_DEFAULT_COLORSPACE_HEADER
#include "ofxColour.h"
#endif
#endif
#ifndef kOfxImageEffectPropColourManagementStyle
#define kOfxImageEffectPropColourManagementStyle "OfxImageEffectPropColourManagementStyle"
#define kOfxImageEffectColourManagementNone "OfxImageEffectColourManagementNone"
#define kOfxImageEffectColourManagementBasic "OfxImageEffectColourManagementBasic"
#define kOfxImageEffectColourManagementFull "OfxImageEffectColourManagementFull"
#define kOfxImageEffectPropColourManagementAvailableConfigs \
    "OfxImageEffectPropColourManagementAvailableConfigs"
#define kOfxImageClipPropColourspace "OfxImageClipPropColourspace"
#define kOfxImageClipPropPreferredColourspaces "OfxImageClipPropPreferredColourspaces"
#define kOfxImageEffectActionGetOutputColourspace "OfxImageEffectActionGetOutputColourspace"
#endif
#ifndef kOfxConfigIdentifier
#define kOfxConfigIdentifier "ofx-native-v1.5_aces-v1.3_ocio-v2.3"
#endif
