/* What the files of the extension share: a library, its types, and checks of buffers. */
#ifndef REFDYN_PYTHON_EXTENSION_H
#define REFDYN_PYTHON_EXTENSION_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <setjmp.h>
#include <stdint.h>
#include <time.h>

#include "refdyn_lanes.h"
#include "runtime/record/record.h"

/* Instead of a place, for a value that the library does not read. FREE_UNREAD: NaN is allowed as well. */
enum { UNREAD = -1, FREE_UNREAD = -2 };

/* How calls pass the inputs or the parameters of a library: by name, or as an array in the model's order. */
struct passing {
    PyObject *places; /* dictionary: place of each name in the library's values, or UNREAD */
    int *order;       /* (given) place of each number of an array, UNREAD or FREE_UNREAD */
    int given;        /* numbers in an array */
};

/* A compiled model. */
struct library {
    PyObject_HEAD void *handle;
    const struct refdyn_model *model;
    const struct refdyn_lane_model *lanes; /* NULL: the library has no functions for lanes */
    const struct refdyn_spatial *spatial;  /* NULL: no point has a spatial Jacobian */
    double *p, *x;                         /* the model's parameters and inputs */
    double *free_p;                        /* the parameters, NaN for those that the start of a motion sets */
    double *prepared;                      /* p as the functions read it: see preparation.c */
    struct passing parameters, inputs;
    int inputs_move_parameters; /* inputs change the prepared parameters or the rules for them */
};

/* The state of the module. */
struct types {
    PyTypeObject *function, *motion, *stepper;
    PyTypeObject *array; /* numpy.ndarray; derived types, such as masked arrays, hold more than doubles */
};

/* ---- A library, and arrays of doubles (library_object.c) ---- */

/* Opens doubles in C order of any shape. Returns 0, without a Python error, if the object has none. */
int refdyn_open_doubles(PyObject *object, Py_buffer *view, int more_flags);
/* Opens `count` doubles, or `rows` rows of `count` doubles. Returns 0 with a Python error if the object has
 * others. */
int refdyn_need_doubles(PyObject *object, const char *name, Py_ssize_t count, Py_ssize_t rows, int more_flags,
                        Py_buffer *view);
/* Address of an exported symbol of the library; NULL if there is none. */
const void *refdyn_find_symbol(const struct library *library, const char *name);
extern PyType_Spec refdyn_library_spec;
/* Library.function (core.c). */
PyObject *refdyn_library_function(PyObject *self, PyObject *arguments);

/* ---- Preparation of parameters (preparation.c) ---- */

/* Numbers in a row of prepared parameters: the parameters, then the derived ones. */
int refdyn_parameter_width(const struct refdyn_model *model);
/* Number of doubles in `scratch` of the functions below. */
size_t refdyn_prepare_scratch(const struct refdyn_model *model);
/* Computes the same as refdyn_prepare, refdyn_initial_state and refdyn_anchor. p is NaN for what the start of
 * a motion sets. */
void refdyn_prepare_values(const struct library *library, double *p, const double *x, double *scratch);
/* Returns the index of the first requirement that the parameters p violate, and its numbers in scratch; -1 if
 * p meets all. */
int refdyn_find_refused(const struct refdyn_model *model, const double *p, const double *x, double *scratch,
                        const double **numbers);
/* Library.prepare. */
PyObject *refdyn_library_prepare(PyObject *self, PyObject *arguments);

/* ---- The arguments of a call about one state (one_call.c) ---- */

/* Rows that a caller passes. OUT and OUT_QD are results. */
enum one_call_view { VIEW_Q, VIEW_QD, VIEW_QDD, VIEW_OUT, VIEW_OUT_QD, VIEW_P, VIEW_X, ONE_CALL_VIEWS };
enum { ONE_CALL_LOCAL = 512 }; /* doubles of scratch in the call itself, enough for small models */

struct one_call {
    const struct library *library;
    const PyTypeObject *array; /* the only type that a row may have */
    Py_buffer views[ONE_CALL_VIEWS];
    int is_open[ONE_CALL_VIEWS];
    const double *p, *x; /* the parameters and inputs that the call passes, or the library's */
    double *own_p, *own_x, *scratch, *more;
    int prepares; /* own_p must be prepared */
    double local[ONE_CALL_LOCAL];
};

/* Begins a call of a method of `self`. more: number of doubles that the caller needs in call->more. Returns 0
 * with a Python error if memory runs out; otherwise refdyn_one_call_end must follow. */
int refdyn_one_call_begin(struct one_call *call, const struct library *library, PyObject *self, int more);
void refdyn_one_call_end(struct one_call *call);
/* Opens one row of `count` doubles; results may have several axes. Returns NULL, without a Python error, for
 * anything else. */
double *refdyn_one_call_row(struct one_call *call, enum one_call_view which, PyObject *object, int count);
/* Reads a Python number. Returns 0, without a Python error, for anything else. */
int refdyn_one_call_number(PyObject *object, double *number);
/* Writes the numbers of a dictionary to their places in `to`; None has no numbers. Returns 0, without a
 * Python error, for anything but finite numbers whose names the library reads. */
int refdyn_read_by_name(const struct passing *passing, PyObject *given, double *to);
/* Reads inputs and parameters. Returns 0, without a Python error, if Python has to check them. */
int refdyn_one_call_values(struct one_call *call, PyObject *inputs, PyObject *parameters);
/* Prepares the parameters of the call. Returns whether the model accepts them. Does not need the lock of the
 * interpreter. */
int refdyn_one_call_prepare(const struct one_call *call);

/* ---- Results as objects of Python (dict_writer.c) ---- */

/* Builds a dictionary from the entries of a record. After an error, which remains set, further entries are
 * skipped. */
struct dict_writer {
    PyObject *open[8]; /* the containers that are open; the first is the result */
    int depth;
};

/* Begins with an open dictionary; returns the writer of its entries. */
struct record_writer refdyn_dict_begin(struct dict_writer *dict);
/* Returns the dictionary, or NULL after an error. */
PyObject *refdyn_dict_end(struct dict_writer *dict);

/* ---- Texts of records ---- */

/* A stream in memory. */
struct text_stream {
    FILE *out;
    char *text;
    size_t size;
};

/* Returns 0 with a Python error without memory. */
int refdyn_text_open(struct text_stream *stream);
/* Closes the stream and returns its text, or NULL with a Python error. */
PyObject *refdyn_text_close(struct text_stream *stream);

/* ---- Motions (motion.c) ---- */

/* Values of parameters and inputs that a caller gives. */
struct given_values {
    PyObject *p, *x;         /* doubles: (parameter_count), (input_count) */
    const char *is_anchored; /* (flags, parameter_count) non-zero: the start of a motion sets the value */
    Py_ssize_t flags;
};

/* Sets the values of a workspace, and given (anchored_count). Returns 0 with a Python error if they do not
 * fit. */
int refdyn_read_values(const struct library *library, const struct given_values *values,
                       struct refdyn_workspace *work, int *given);
/* "FILE:LINE: subject: fact" for a parameter value that the model refuses. places: "FILE:LINE" of each
 * requirement. */
void refdyn_write_refused(const struct refdyn_workspace *work, PyObject *places, char *text, size_t size);

/* What copies of a motion contain: one piece of memory, whose pointers into itself move with it. */
struct motion_block {
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    struct record_motion record;
};

/* Pieces of memory of the record. */
struct motion_piece {
    struct motion_piece *next;
    double data[];
};

struct motion {
    PyObject_HEAD struct library *library; /* held */
    PyObject
        *follow; /* held: called now and then; returns the optimised library once it is there, else None */
    PyObject *newer;            /* held: that library, whose functions are in use; NULL if there is none */
    PyObject *places;           /* held: "FILE:LINE" of each requirement of the model */
    struct motion_block *block; /* with the memory of workspace and integrator, and the start */
    size_t size, work_at, integrator_at, start_at, before_at; /* of the block, and places in it [bytes] */
    int *given; /* (anchored_count) non-zero: the parameter keeps its value */
    struct motion_piece *pieces;
    jmp_buf no_memory;
    struct refdyn_options options;
    struct record_table table;
    struct record_limits limits;
    struct record_stops stops;
    struct refdyn_samples samples;
    PyObject *held;                           /* what stops and samples read */
    struct refdyn_statics_result equilibrium; /* where the motion starts, if has_equilibrium */
    int has_equilibrium;
    int has_start[2]; /* the caller has given q; qd */
    double cpu_s, wall_s;
    int status, is_started; /* of the last call of the runtime; the start could be evaluated */
    const char *unfit;      /* the column that was not finite; NULL if none was */
    int is_busy;
};

/* The interpreter's lock, while C computes without it. */
struct unlocked {
    PyThreadState *thread;
    double asked;          /* time of the last check for signals [s] */
    int is_interrupted;    /* by a signal, whose exception is set */
    struct motion *motion; /* the motion that computes; NULL: an equilibrium, or steps */
};

/* A new motion, not started. Returns NULL with a Python error without memory. */
struct motion *refdyn_motion_new(PyTypeObject *type, struct library *library, PyObject *places,
                                 PyObject *follow);
/* Zeroed memory that lasts as long as the motion (the context). Jumps to no_memory if there is none. */
void *refdyn_motion_memory(void *context, size_t size);
void refdyn_motion_release(struct motion *motion);
/* A place in the block. */
void *refdyn_motion_at(const struct motion *motion, size_t place);
/* Between them, the caller alone uses the motion. `enter` returns 0 with a Python error if another thread
 * does; `leave` returns `result`. */
int refdyn_motion_enter(struct motion *motion);
PyObject *refdyn_motion_leave(struct motion *motion, PyObject *result);
double refdyn_seconds(clockid_t clock);
/* About every 10 ms checks for signals, and for the optimised library of a motion. Returns RECORD_INTERRUPTED
 * after a signal that raises an exception. context: struct unlocked. */
int refdyn_ask(void *context);
/* The same, for the callback of a record_watch. */
int refdyn_motion_ask(void *context, const struct record_motion *record);
/* Prints what `sim` prints on stderr after a failure. */
void refdyn_motion_print_failure(const struct motion *motion, FILE *out);

/* Methods of a motion. */
PyObject *refdyn_motion_start(PyObject *self, PyObject *arguments);
PyObject *refdyn_motion_rows(PyObject *self, PyObject *out);
PyObject *refdyn_motion_summary(PyObject *self, PyObject *nothing);
PyObject *refdyn_motion_derivatives(PyObject *self, PyObject *arguments); /* motion_derivatives_call.c */
PyObject *refdyn_motion_advance(PyObject *self, PyObject *t);
PyObject *refdyn_motion_refresh(PyObject *self, PyObject *arguments);
PyObject *refdyn_motion_set(PyObject *self, PyObject *const *given, Py_ssize_t count);
PyObject *refdyn_motion_steps(PyObject *self, PyObject *arguments);

extern PyType_Spec refdyn_motion_spec;
/* Methods of a library. */
PyObject *refdyn_library_motion(PyObject *self, PyObject *arguments);
PyObject *refdyn_library_columns(PyObject *self, PyObject *nothing);

/* ---- Equilibria (statics_call.c) ---- */

PyObject *refdyn_library_statics(PyObject *self, PyObject *arguments);

/* ---- Small motions (modes_call.c) ---- */

PyObject *refdyn_library_modes(PyObject *self, PyObject *arguments);

/* ---- What has become of the states of arm.step (step_report.c) ---- */

/* UNFIT: q, qd or t is not finite before the step. FAILED: the step could not be taken. Both make the result
 * NaN. ENDED: an event of the model has ended the motion; the result is the state there. */
enum step_outcome { STEP_UNFIT, STEP_FAILED, STEP_ENDED, STEP_OUTCOMES };

/* One state before and after the step. */
struct step_row {
    Py_ssize_t index;
    int n;
    const double *t, *q, *qd; /* one number, (n), (n) */
    double *new_q, *new_qd;   /* (n) each */
};

struct step_report {
    Py_ssize_t count[STEP_OUTCOMES], first[STEP_OUTCOMES]; /* states, and the index of the first of them */
    PyObject *reason;  /* held: the message of the first failure; NULL: the result was not finite */
    const char *event; /* that has ended the first motion; NULL if none has ended */
    double after;      /* time from its t to that event [s] */
};

int refdyn_step_is_unfit(const struct step_row *row);
/* Returns whether t and the result are finite. */
int refdyn_step_is_finite(const struct step_row *row);
/* Notes an outcome; returns whether it is the first of its kind. */
int refdyn_step_note(struct step_report *report, const struct step_row *row, enum step_outcome outcome);
/* Returns None if all states were stepped, otherwise ((count, first) of each outcome, reason, event,
 * after). */
PyObject *refdyn_step_report(const struct step_report *report);

/* ---- Explicit steps (step_call.c) ---- */

extern PyType_Spec refdyn_stepper_spec;
PyObject *refdyn_library_stepper(PyObject *self, PyObject *arguments);

#endif
