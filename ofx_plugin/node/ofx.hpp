// The OpenFX interface, with names that older SDKs lack.
#pragma once

#include "ofxCore.h"
#include "ofxImageEffect.h"
#include "ofxMessage.h"
#include "ofxMultiThread.h"
#include "ofxParam.h"
#include "ofxProgress.h"
#include "ofxProperty.h"

// From OFX 1.4 (in ofxGPURender.h, which we do not need otherwise) and OFX 1.5.1.
#ifndef kOfxImageEffectPropCPURenderSupported
#define kOfxImageEffectPropCPURenderSupported "OfxImageEffectPropCPURenderSupported"
#endif
#ifndef kOfxImageEffectPropNoSpatialAwareness
#define kOfxImageEffectPropNoSpatialAwareness "OfxImageEffectPropNoSpatialAwareness"
#endif

// From OFX 1.5 (in ofxGPURender.h): images in a GPU's memory. OpenCL's are buffers.
#ifndef kOfxImageEffectPropOpenCLRenderSupported
#define kOfxImageEffectPropOpenCLRenderSupported "OfxImageEffectPropOpenCLRenderSupported"
#define kOfxImageEffectPropOpenCLEnabled "OfxImageEffectPropOpenCLEnabled"
#define kOfxImageEffectPropOpenCLCommandQueue "OfxImageEffectPropOpenCLCommandQueue"
#endif
#ifndef kOfxImageEffectPropCudaRenderSupported
#define kOfxImageEffectPropCudaRenderSupported "OfxImageEffectPropCudaRenderSupported"
#define kOfxImageEffectPropCudaStreamSupported "OfxImageEffectPropCudaStreamSupported"
#define kOfxImageEffectPropCudaEnabled "OfxImageEffectPropCudaEnabled"
#define kOfxImageEffectPropCudaStream "OfxImageEffectPropCudaStream"
#endif
#ifndef kOfxImageEffectPropMetalRenderSupported
#define kOfxImageEffectPropMetalRenderSupported "OfxImageEffectPropMetalRenderSupported"
#define kOfxImageEffectPropMetalEnabled "OfxImageEffectPropMetalEnabled"
#define kOfxImageEffectPropMetalCommandQueue "OfxImageEffectPropMetalCommandQueue"
#endif
#ifndef kOfxStatGPURenderFailed
#define kOfxStatGPURenderFailed ((int)1002)
#endif

// Nuke's extension, which Natron supports too: keeps the next parameter on the same row.
#define kOfxParamPropLayoutHint "OfxParamPropLayoutHint"
#define kOfxParamPropLayoutHintNoNewLine 2

// DaVinci Resolve's. On the effect instance: the media file, or a sequence's first file. In the
// render action's arguments: the frame of that media, counted from 0.
#define kResolvePropSrcFilePath "OfxImageEffectPropSrcFilePath"
#define kResolvePropSrcFrame "OfxImageEffectPropSrcFrame"

// From OFX 1.5: older SDKs lack all of it. Newer ones include a configuration of thousands of
// lines, which is not needed here.
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
