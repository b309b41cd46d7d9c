/* The entries of a record as a dictionary, and its messages as a text. */
#include "runtime/bindings/python/extension.h"

#include <stdlib.h>

enum { DEPTH_MOST = sizeof((struct dict_writer *)0)->open / sizeof(PyObject *) };

/* Adds a value, whose reference it takes, to the innermost open container. */
static void add(struct dict_writer *dict, const char *key, PyObject *value) {
    PyObject *to = dict->open[dict->depth - 1];
    if (value && !PyErr_Occurred()) {
        if (PyList_Check(to))
            PyList_Append(to, value);
        else
            PyDict_SetItemString(to, key, value);
    }
    Py_XDECREF(value);
}

/* The containers keep the opened one alive; the result itself is the writer's. */
static void open_container(void *context, const char *key, char bracket) {
    struct dict_writer *dict = context;
    PyObject *container = bracket == '{' ? PyDict_New() : PyList_New(0);
    if (!container || dict->depth == DEPTH_MOST) {
        Py_XDECREF(container);
        if (!PyErr_Occurred())
            PyErr_SetString(PyExc_RecursionError, "a result is too deep");
        return;
    }
    add(dict, key, container);
    if (!PyErr_Occurred())
        dict->open[dict->depth++] = container;
}

static void close_container(void *context, char bracket) {
    struct dict_writer *dict = context;
    (void)bracket;
    if (!PyErr_Occurred())
        dict->depth--;
}

static void put_number(void *context, const char *key, double value) {
    add(context, key, PyFloat_FromDouble(value));
}

static void put_whole(void *context, const char *key, long value) {
    add(context, key, PyLong_FromLong(value));
}

static void put_text(void *context, const char *key, const char *text) {
    add(context, key, PyUnicode_FromString(text));
}

static void put_truth(void *context, const char *key, bool value) {
    add(context, key, PyBool_FromLong(value));
}

static void put_null(void *context, const char *key) {
    add(context, key, Py_NewRef(Py_None));
}

struct record_writer refdyn_dict_begin(struct dict_writer *dict) {
    *dict = (struct dict_writer){.open = {PyDict_New()}, .depth = 1};
    return (struct record_writer){dict,      open_container, close_container, put_number,
                                  put_whole, put_text,       put_truth,       put_null};
}

PyObject *refdyn_dict_end(struct dict_writer *dict) {
    if (PyErr_Occurred())
        Py_CLEAR(dict->open[0]);
    return dict->open[0];
}

int refdyn_text_open(struct text_stream *stream) {
    *stream = (struct text_stream){.out = NULL};
    stream->out = open_memstream(&stream->text, &stream->size);
    if (!stream->out)
        PyErr_NoMemory();
    return stream->out != NULL;
}

PyObject *refdyn_text_close(struct text_stream *stream) {
    PyObject *text = fclose(stream->out) == 0
                         ? PyUnicode_DecodeUTF8(stream->text, (Py_ssize_t)stream->size, "replace")
                         : PyErr_NoMemory();
    free(stream->text);
    return text;
}
