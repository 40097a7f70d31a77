/* OpenFX progress suite, version 1. */
#ifndef PALETTE4D_OFX_PROGRESS_H
#define PALETTE4D_OFX_PROGRESS_H

#include "ofxCore.h"

#ifdef __cplusplus
extern "C" {
#endif

#define kOfxProgressSuite "OfxProgressSuite"

/* progressUpdate: 0 to 1; kOfxStatReplyNo when the user has cancelled. */
typedef struct OfxProgressSuiteV1 {
    OfxStatus (*progressStart)(void* effectInstance, const char* label);
    OfxStatus (*progressUpdate)(void* effectInstance, double progress);
    OfxStatus (*progressEnd)(void* effectInstance);
} OfxProgressSuiteV1;

#ifdef __cplusplus
}
#endif

#endif
