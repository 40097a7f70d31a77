/* OpenFX colour management, from OFX 1.5 (subset, see README.md). */
#ifndef PALETTE4D_OFX_COLOUR_H
#define PALETTE4D_OFX_COLOUR_H

#include "ofxImageEffect.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Names of colour spaces are those of this OpenColorIO configuration, in all but the OCIO style. */
#define kOfxConfigIdentifier "ofx-native-v1.5_aces-v1.3_ocio-v2.3"

#define kOfxImageEffectPropColourManagementStyle "OfxImageEffectPropColourManagementStyle"
#define kOfxImageEffectColourManagementNone "OfxImageEffectColourManagementNone"
#define kOfxImageEffectColourManagementBasic "OfxImageEffectColourManagementBasic"
#define kOfxImageEffectColourManagementCore "OfxImageEffectColourManagementCore"
#define kOfxImageEffectColourManagementFull "OfxImageEffectColourManagementFull"
#define kOfxImageEffectColourManagementOCIO "OfxImageEffectColourManagementOCIO"
#define kOfxImageEffectPropColourManagementAvailableConfigs \
    "OfxImageEffectPropColourManagementAvailableConfigs"
#define kOfxImageEffectPropColourManagementConfig "OfxImageEffectPropColourManagementConfig"
#define kOfxImageClipPropColourspace "OfxImageClipPropColourspace"
/* In GetClipPreferences with "_" and the clip's name after it. */
#define kOfxImageClipPropPreferredColourspaces "OfxImageClipPropPreferredColourspaces"
/* A plug-in says which colour space its output is in: that of a clip is "OfxColourspace_<clip>". */
#define kOfxImageEffectActionGetOutputColourspace "OfxImageEffectActionGetOutputColourspace"

#ifdef __cplusplus
}
#endif

#endif
