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
