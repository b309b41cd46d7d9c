/*
 * Functions that an FMU's library gives to importers.
 *
 * Importers that link sources into a program put FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX before them, as
 * the standard has it. Names behind them have no prefix: a program holds the sources of one FMU of Refdyn.
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
