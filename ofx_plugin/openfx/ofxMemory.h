/* OpenFX memory suite, version 1. */
#ifndef PALETTE4D_OFX_MEMORY_H
#define PALETTE4D_OFX_MEMORY_H

#include "ofxCore.h"

#ifdef __cplusplus
extern "C" {
#endif

#define kOfxMemorySuite "OfxMemorySuite"

typedef struct OfxMemorySuiteV1 {
    OfxStatus (*memoryAlloc)(void* handle, size_t bytes, void** data);
    OfxStatus (*memoryFree)(void* data);
} OfxMemorySuiteV1;

#ifdef __cplusplus
}
#endif

#endif
