/* A value that the command line gives to an option or a parameter of the model: --set NAME=VALUE. */
#ifndef REFDYN_GEN_SETTING_H
#define REFDYN_GEN_SETTING_H

struct setting {
    const char *name, *value;
};

#endif
