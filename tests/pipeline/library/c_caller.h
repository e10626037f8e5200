/* Encodes and reads a volume, in C. */
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

/* 1 where the samples came back. */
int c_round_trip(void);

#ifdef __cplusplus
}
#endif
