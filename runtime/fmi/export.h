/*
 * Functions that an FMU's library gives to importers.
 *
 * FMI_PREFIX is "NAME_" where sources of several FMUs are linked into one program; a library of its own needs
 * none. FMI2_FUNCTION_PREFIX and FMI3_FUNCTION_PREFIX are the standard's names for it.
 */
#ifndef REFDYN_FMI_EXPORT_H
#define REFDYN_FMI_EXPORT_H

#if defined(_WIN32)
#define FMI_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI_EXPORT __attribute__((visibility("default")))
#else
#define FMI_EXPORT
#endif

#define FMI_JOIN_(a, b) a##b
#define FMI_JOIN(a, b) FMI_JOIN_(a, b)

#endif
