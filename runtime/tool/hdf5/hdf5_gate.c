/* The process that reads files of HDF5: see hdf5_gate.h. */
#include "hdf5/hdf5_gate.h"
#include "base/utf8.h"
#include "hdf5/hdf5_file.h"
#include "text/output.h"

#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

/* An object of the file. Paths begin with a slash. */
struct entry {
    const char *path;
    haddr_t address;
    H5O_type_t type;
    int group;     /* its number */
    hid_t dataset; /* open; negative: it is none, or was not needed yet */
    enum hdf5_kind kind;
    int rank;
    hsize_t size[2]; /* rows, and numbers a row, 0: one in a dataset with one axis */
};

/* Where an entry lies in the file. */
struct place {
    haddr_t address;
    int entry;
};

enum {
    DEEPEST = 32,      /* groups in groups */
    MOST_PACKED = 1100 /* bytes that one byte of a file may stand for; 1032 is the most of zlib */
};

struct gate {
    FILE *out;    /* to the program */
    FILE *answer; /* in the making, into `text`: the program gets a whole one, or a fact instead */
    char *text;
    size_t length;
    hid_t file;
    double bytes; /* of the file */
    struct entry *entries;
    int count, room;
    struct place *places; /* (count) of the entries in the file, in order */
    double text_left;     /* bytes of texts that the present request may still take */
};

/* ---- Answers ---- */

static void send_whole(struct gate *gate, int64_t number) {
    fwrite(&number, sizeof number, 1, gate->answer);
}

static void send_bytes(struct gate *gate, const char *text, size_t length) {
    send_whole(gate, (int64_t)length);
    fwrite(text, 1, length, gate->answer);
}

static void begin_answer(struct gate *gate, enum gate_answer answer) {
    gate->answer = text_stream(&gate->text, &gate->length);
    send_whole(gate, answer);
}

static void end_answer(struct gate *gate) {
    fclose(gate->answer);
    if (fwrite(gate->text, 1, gate->length, gate->out) != gate->length || fflush(gate->out) != 0)
        _exit(1);
    free(gate->text);
}

static _Noreturn void refuse(struct gate *gate, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static _Noreturn void refuse(struct gate *gate, const char *format, ...) {
    va_list list;
    va_start(list, format);
    const char *text = text_vformat(format, list);
    va_end(list);
    begin_answer(gate, GATE_FACT);
    send_bytes(gate, text, strlen(text));
    end_answer(gate);
    _exit(0);
}

/* Passes what HDF5 gave on, unless that is an error. */
static hid_t good(struct gate *gate, const char *path, hid_t result) {
    if (result < 0)
        refuse(gate, "damaged: %s: %s", path, hdf5_cause());
    return result;
}

/* ---- Bounds ---- */

static void bound(int resource, rlim_t most) {
    struct rlimit limit;
    if (getrlimit(resource, &limit) == 0 && (limit.rlim_max == RLIM_INFINITY || most < limit.rlim_max)) {
        limit.rlim_cur = most;
        setrlimit(resource, &limit);
    }
}

/* Lengths in a damaged file may ask for any amount. Where the system does not say how much this process has,
 * only the bounds on texts hold. */
static void bound_memory(const struct gate *gate) {
    const double more = 1e9 + 4 * gate->bytes;
    unsigned long long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%llu", &pages) == 1)
        bound(RLIMIT_AS, (rlim_t)((double)pages * (double)sysconf(_SC_PAGESIZE) + more));
    if (file)
        fclose(file);
}

/* Of the next request. */
static void bound_work(struct gate *gate) {
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    bound(RLIMIT_CPU, (rlim_t)(used.ru_utime.tv_sec + used.ru_stime.tv_sec + 1 + GATE_SECONDS) +
                          (rlim_t)(gate->bytes / GATE_BYTES_PER_SECOND));
    gate->text_left = gate->bytes;
}

/* For HDF5, which asks for the texts of a dataset. */
static void *allocate_text(size_t size, void *where) {
    struct gate *gate = where;
    if ((double)size > gate->text_left + 1)
        return NULL;
    gate->text_left -= (double)size;
    return malloc(size + 1);
}

static void free_text(void *text, void *where) {
    (void)where;
    free(text);
}

/* ---- The objects ---- */

/* Names in a group. */
struct names {
    struct gate *gate;
    const char *path; /* of the group */
    const char **list;
    int count, room;
};

static bool is_utf8(const char *text, size_t length) {
    unsigned code;
    for (size_t at = 0, step; at < length; at += step)
        if ((step = (size_t)utf8_decode(text + at, length - at, &code)) == 0 || code == 0)
            return false;
    return true;
}

static const char *path_of(const char *group, const char *name) {
    return text_format("%s/%s", strcmp(group, "/") == 0 ? "" : group, name);
}

static herr_t take_link(hid_t group, const char *name, const H5L_info_t *info, void *where) {
    struct names *names = where;
    const char *path = path_of(names->path, name);
    (void)group;
    if (!is_utf8(name, strlen(name)))
        refuse(names->gate, "damaged: a name in %s is not UTF-8", names->path);
    if (info->type == H5L_TYPE_EXTERNAL)
        refuse(names->gate, "%s: is a link to another file, which is not followed", path);
    if (info->type != H5L_TYPE_HARD)
        refuse(names->gate, "%s: is a link to another name, which is not followed", path);
    names->list = memory_room(&program_memory, names->list, names->count, &names->room, sizeof *names->list);
    names->list[names->count++] = path;
    return 0;
}

/* In the order in which they were made, where the group keeps it. */
static struct names list_names(struct gate *gate, const char *path) {
    struct names names = {.gate = gate, .path = path};
    if (H5Literate_by_name(gate->file, path, H5_INDEX_CRT_ORDER, H5_ITER_INC, NULL, take_link, &names,
                           H5P_DEFAULT) >= 0)
        return names;
    names.count = 0;
    good(gate, path,
         H5Literate_by_name(gate->file, path, H5_INDEX_NAME, H5_ITER_INC, NULL, take_link, &names,
                            H5P_DEFAULT));
    return names;
}

static int add_entry(struct gate *gate, const char *path, int group) {
    H5O_info_t info;
    good(gate, path, H5Oget_info_by_name2(gate->file, path, &info, H5O_INFO_BASIC, H5P_DEFAULT));
    if (group >= 0 && info.rc != 1)
        refuse(gate, "%s: has %u names in the file; it must have one", path, info.rc);
    gate->entries =
        memory_room(&program_memory, gate->entries, gate->count, &gate->room, sizeof *gate->entries);
    gate->entries[gate->count] =
        (struct entry){.path = path, .address = info.addr, .type = info.type, .group = group, .dataset = -1};
    return gate->count++;
}

/* All that is in a group follows it. */
static void add_entries(struct gate *gate, int group, int depth) {
    const char *path = gate->entries[group].path;
    const struct names names = list_names(gate, path);
    if (depth == DEEPEST)
        refuse(gate, "%s: lies more than %d groups deep", path, (int)DEEPEST);
    for (int i = 0; i < names.count; i++) {
        const int entry = add_entry(gate, names.list[i], group);
        if (gate->entries[entry].type == H5O_TYPE_GROUP)
            add_entries(gate, entry, depth + 1);
    }
}

static int compare_places(const void *a, const void *b) {
    const haddr_t x = ((const struct place *)a)->address, y = ((const struct place *)b)->address;
    return x < y ? -1 : x > y;
}

static void sort_places(struct gate *gate) {
    gate->places = allocate((size_t)gate->count, sizeof *gate->places);
    for (int i = 0; i < gate->count; i++)
        gate->places[i] = (struct place){gate->entries[i].address, i};
    qsort(gate->places, (size_t)gate->count, sizeof *gate->places, compare_places);
    for (int i = 1; i < gate->count; i++)
        if (gate->places[i].address == gate->places[i - 1].address)
            refuse(gate, "damaged: %s and %s are one object", gate->entries[gate->places[i - 1].entry].path,
                   gate->entries[gate->places[i].entry].path);
}

/* The entry that a reference is to; `what` it is there. */
static const struct entry *referred(struct gate *gate, const char *path, const char *what,
                                    hobj_ref_t reference) {
    const struct place key = {.address = reference};
    const struct place *place = bsearch(&key, gate->places, (size_t)gate->count, sizeof key, compare_places);
    if (!place)
        refuse(gate, "%s: %s is missing", path, what);
    return &gate->entries[place->entry];
}

/* ---- Values ---- */

static enum hdf5_kind kind_of(hid_t type) {
    switch (H5Tget_class(type)) {
    case H5T_STRING:
        return HDF5_TEXTS;
    case H5T_INTEGER:
        return HDF5_WHOLES;
    case H5T_FLOAT:
        return HDF5_NUMBERS;
    default:
        return HDF5_OTHER;
    }
}

/* Data of `count` elements have to be in the file, packed at most as HDF5's filters can. */
static void check_fit(struct gate *gate, const char *path, double count, hid_t type) {
    if (count * (double)H5Tget_size(type) > MOST_PACKED * gate->bytes)
        refuse(gate, "damaged: %s: %.0f values do not fit into a file of %.0f bytes", path, count,
               gate->bytes);
}

/* `count` texts as the type has them in memory: pointers, of which an empty one may be NULL, or one after the
 * other in fields of one length. */
static void send_texts(struct gate *gate, hid_t type, const void *texts, size_t count) {
    const size_t size = H5Tget_size(type);
    const bool is_padded = H5Tget_strpad(type) == H5T_STR_SPACEPAD;
    for (size_t i = 0; i < count; i++) {
        const char *field = (const char *)texts + i * size, *text = field;
        if (H5Tis_variable_str(type) > 0)
            text = ((char *const *)texts)[i];
        size_t length = !text ? 0 : text == field ? strnlen(text, size) : strlen(text);
        while (text == field && is_padded && length > 0 && text[length - 1] == ' ')
            length--;
        send_bytes(gate, text ? text : "", length);
    }
}

/* ---- Attributes ---- */

/* Of an entry, open. */
struct attribute {
    hid_t id, type;
    hssize_t length; /* values */
    bool is_list;
};

static struct attribute open_attribute(struct gate *gate, const char *path, const char *name) {
    struct attribute attribute = {
        .id = good(gate, path, H5Aopen_by_name(gate->file, path, name, H5P_DEFAULT, H5P_DEFAULT))};
    const hid_t space = good(gate, path, H5Aget_space(attribute.id));
    attribute.type = good(gate, path, H5Aget_type(attribute.id));
    attribute.length = H5Sget_simple_extent_npoints(space);
    attribute.is_list = H5Sget_simple_extent_ndims(space) > 0;
    H5Sclose(space);
    good(gate, path, attribute.length < 0 ? -1 : 0);
    check_fit(gate, path, (double)attribute.length, attribute.type);
    return attribute;
}

static void close_attribute(struct attribute *attribute) {
    H5Tclose(attribute->type);
    H5Aclose(attribute->id);
}

/* In heap memory, as `type` has them. */
static void *read_attribute(struct gate *gate, const char *path, const struct attribute *attribute,
                            hid_t type) {
    void *values = allocate_large((size_t)attribute->length + 1, H5Tget_size(type));
    if (attribute->length > 0)
        good(gate, path, H5Aread(attribute->id, type, values));
    return values;
}

static void send_attribute(struct gate *gate, const char *path, const char *name) {
    struct attribute attribute = open_attribute(gate, path, name);
    const enum hdf5_kind kind = kind_of(attribute.type);
    if (kind != HDF5_OTHER) {
        const hid_t type = kind == HDF5_TEXTS ? attribute.type : H5T_NATIVE_DOUBLE;
        void *values = read_attribute(gate, path, &attribute, type);
        send_whole(gate, kind);
        send_bytes(gate, name, strlen(name));
        send_whole(gate, attribute.is_list ? attribute.length : GATE_SINGLE);
        if (kind == HDF5_TEXTS)
            send_texts(gate, type, values, (size_t)attribute.length);
        else
            fwrite(values, sizeof(double), (size_t)attribute.length, gate->answer);
        free(values);
    }
    close_attribute(&attribute);
}

struct described {
    struct gate *gate;
    const char *path;
};

static herr_t take_attribute(hid_t object, const char *name, const H5A_info_t *info, void *where) {
    const struct described *described = where;
    (void)object;
    (void)info;
    send_attribute(described->gate, described->path, name);
    return 0;
}

static void send_attributes(struct gate *gate, const char *path) {
    struct described described = {gate, path};
    good(gate, path,
         H5Aiterate_by_name(gate->file, path, H5_INDEX_NAME, H5_ITER_INC, NULL, take_attribute, &described,
                            H5P_DEFAULT));
    send_whole(gate, GATE_NO_MORE);
}

/* ---- Dimension scales ---- */

static bool has_attribute(struct gate *gate, const char *path, const char *name) {
    return good(gate, path, H5Aexists_by_name(gate->file, path, name, H5P_DEFAULT)) > 0;
}

/* The path of the scale along the second axis; "": there is none. */
static const char *find_axis(struct gate *gate, const char *path) {
    static const char name[] = "DIMENSION_LIST";
    const char *axis = "";
    if (!has_attribute(gate, path, name))
        return axis;
    struct attribute attribute = open_attribute(gate, path, name);
    const hid_t type = H5Tvlen_create(H5T_STD_REF_OBJ);
    hvl_t *lists = read_attribute(gate, path, &attribute, type);
    for (hssize_t i = 0; i < attribute.length; i++) {
        const hobj_ref_t *references = lists[i].p;
        for (size_t k = 0; k < lists[i].len; k++) {
            const char *found = referred(gate, path, "the scale of an axis", references[k])->path;
            axis = i == 1 && k == 0 ? found : axis;
        }
        free(lists[i].p);
    }
    free(lists);
    H5Tclose(type);
    close_attribute(&attribute);
    return axis;
}

/* A scale knows the datasets along it: all of them have to be there. */
static void check_datasets_along(struct gate *gate, const char *path) {
    static const char name[] = "REFERENCE_LIST";
    if (!has_attribute(gate, path, name))
        return;
    struct attribute attribute = open_attribute(gate, path, name);
    const hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(hobj_ref_t));
    good(gate, path, H5Tinsert(type, "dataset", 0, H5T_STD_REF_OBJ));
    hobj_ref_t *references = read_attribute(gate, path, &attribute, type);
    for (hssize_t i = 0; i < attribute.length; i++)
        referred(gate, path, "a dataset along this scale", references[i]);
    free(references);
    H5Tclose(type);
    close_attribute(&attribute);
}

/* ---- Datasets ---- */

static void check_filters(struct gate *gate, const char *path, hid_t creation) {
    for (int i = H5Pget_nfilters(creation); i-- > 0;) {
        unsigned flags, settings;
        size_t no_settings = 0;
        const H5Z_filter_t filter =
            H5Pget_filter2(creation, (unsigned)i, &flags, &no_settings, NULL, 0, NULL, &settings);
        if (filter < 0 || filter >= H5Z_FILTER_RESERVED)
            refuse(gate, "%s: its data are packed by filter %d, which refdyn does not know", path, filter);
    }
}

/* Before anything asks for its size: that opens the files of a virtual dataset. */
static bool check_storage(struct gate *gate, const char *path, hid_t dataset) {
    const hid_t creation = good(gate, path, H5Dget_create_plist(dataset));
    const H5D_layout_t layout = H5Pget_layout(creation);
    if (layout == H5D_VIRTUAL || H5Pget_external_count(creation) != 0)
        refuse(gate, "%s: its data lie in other files, which are not followed", path);
    check_filters(gate, path, creation);
    const bool is_packed = H5Pget_nfilters(creation) > 0;
    H5Pclose(creation);
    return is_packed;
}

static void check_data(struct gate *gate, const struct entry *entry, hid_t type, hid_t space,
                       bool is_packed) {
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    good(gate, entry->path, count < 0 ? -1 : 0);
    check_fit(gate, entry->path, (double)count, type);
    const double stored = (double)H5Dget_storage_size(entry->dataset),
                 needed = (double)count * (double)H5Tget_size(type);
    if (stored < (is_packed ? fmin(needed, 1) : needed))
        refuse(gate, "damaged: %s: data are missing", entry->path);
}

/* Opens the dataset, and finds its kind and its sizes. */
static void look_at_dataset(struct gate *gate, struct entry *entry) {
    entry->dataset = good(gate, entry->path, H5Dopen2(gate->file, entry->path, H5P_DEFAULT));
    const bool is_packed = check_storage(gate, entry->path, entry->dataset);
    const hid_t type = good(gate, entry->path, H5Dget_type(entry->dataset)),
                space = good(gate, entry->path, H5Dget_space(entry->dataset));
    entry->rank = (int)good(gate, entry->path, H5Sget_simple_extent_ndims(space));
    entry->kind = kind_of(type);
    if (entry->kind != HDF5_OTHER)
        check_data(gate, entry, type, space, is_packed);
    if (entry->rank == 1 || entry->rank == 2)
        H5Sget_simple_extent_dims(space, entry->size, NULL);
    H5Sclose(space);
    H5Tclose(type);
}

/* Before any attribute is read: what another object lacks may be what is wrong with this one. */
static void look_at_entries(struct gate *gate) {
    for (int i = 0; i < gate->count; i++) {
        struct entry *entry = &gate->entries[i];
        if (entry->type == H5O_TYPE_DATASET)
            look_at_dataset(gate, entry);
        else if (entry->type != H5O_TYPE_GROUP)
            refuse(gate, "%s: is neither a group nor a dataset", entry->path);
    }
}

static void send_entry(struct gate *gate, const struct entry *entry) {
    begin_answer(gate, GATE_OBJECT);
    send_whole(gate, entry->group);
    send_whole(gate, entry->kind);
    send_whole(gate, entry->rank);
    send_whole(gate, (int64_t)entry->size[0]);
    send_whole(gate, (int64_t)entry->size[1]);
    send_bytes(gate, entry->path, strlen(entry->path));
    const char *axis = find_axis(gate, entry->path);
    send_bytes(gate, axis, strlen(axis));
    check_datasets_along(gate, entry->path);
    send_attributes(gate, entry->path);
    end_answer(gate);
}

static void send_entries(struct gate *gate) {
    add_entry(gate, "/", -1);
    add_entries(gate, 0, 0);
    sort_places(gate);
    look_at_entries(gate);
    for (int i = 0; i < gate->count; i++)
        send_entry(gate, &gate->entries[i]);
    begin_answer(gate, GATE_END);
    end_answer(gate);
}

/* ---- Rows ---- */

static hid_t select_rows(struct gate *gate, const struct entry *entry, const struct gate_request *request) {
    const hsize_t start[2] = {(hsize_t)request->first, 0},
                  count[2] = {(hsize_t)request->count, entry->size[1]};
    const hid_t space = good(gate, entry->path, H5Dget_space(entry->dataset));
    good(gate, entry->path, H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL));
    return space;
}

static void read_rows(struct gate *gate, const struct entry *entry, const struct gate_request *request,
                      hid_t type, void *values) {
    const hsize_t count = (hsize_t)request->count * (entry->size[1] > 0 ? entry->size[1] : 1);
    const hid_t memory = H5Screate_simple(1, &count, NULL), stored = select_rows(gate, entry, request);
    const hid_t transfer = H5Pcreate(H5P_DATASET_XFER);
    H5Pset_vlen_mem_manager(transfer, allocate_text, gate, free_text, NULL);
    good(gate, entry->path, H5Dread(entry->dataset, type, memory, stored, transfer, values));
    H5Pclose(transfer);
    H5Sclose(stored);
    H5Sclose(memory);
}

static void send_rows(struct gate *gate, const struct entry *entry, const struct gate_request *request) {
    const size_t count = (size_t)request->count * (entry->size[1] > 0 ? (size_t)entry->size[1] : 1);
    const hid_t stored = good(gate, entry->path, H5Dget_type(entry->dataset)),
                type = entry->kind == HDF5_TEXTS ? stored : H5T_NATIVE_DOUBLE;
    void *values = allocate_large(count + 1, H5Tget_size(type));
    read_rows(gate, entry, request, type, values);
    begin_answer(gate, GATE_ROWS);
    if (entry->kind == HDF5_TEXTS)
        send_texts(gate, type, values, count);
    else
        fwrite(values, sizeof(double), count, gate->answer);
    for (size_t i = 0; entry->kind == HDF5_TEXTS && H5Tis_variable_str(type) > 0 && i < count; i++)
        free(((char **)values)[i]);
    free(values);
    H5Tclose(stored);
    end_answer(gate);
}

/* ---- The process ---- */

static bool get_request(int socket, struct gate_request *request) {
    return recv(socket, request, sizeof *request, MSG_WAITALL) == (ssize_t)sizeof *request;
}

/* A signal that ends the program closes the other end of the socket, which ends this process. What the
 * library and the allocator print about a damaged file is not for the user. */
static void part_from_program(void) {
    const int ignored[] = {SIGHUP, SIGINT, SIGPIPE}, ending[] = {SIGTERM, SIGXCPU, SIGXFSZ};
    const int nowhere = open("/dev/null", O_RDWR);
    for (size_t i = 0; i < sizeof ignored / sizeof ignored[0]; i++)
        signal(ignored[i], SIG_IGN);
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++)
        signal(ending[i], SIG_DFL);
    for (int descriptor = STDIN_FILENO; nowhere >= 0 && descriptor <= STDERR_FILENO; descriptor++)
        dup2(nowhere, descriptor);
    bound(RLIMIT_CORE, 0);
}

static void open_file(struct gate *gate, const char *path) {
    struct stat status;
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    H5PLset_loading_state(0);
    H5Pset_file_locking(access, false, true);
    gate->bytes = stat(path, &status) == 0 ? (double)status.st_size : 0;
    bound_memory(gate);
    bound_work(gate);
    gate->file = H5Fopen(path, H5F_ACC_RDONLY, access);
    if (gate->file < 0)
        refuse(gate, "cannot be read: %s", hdf5_cause());
    H5Pclose(access);
}

void gate_serve(const char *path, int socket) {
    struct gate gate = {.out = fdopen(socket, "w")};
    struct gate_request request;
    if (!gate.out)
        _exit(1);
    part_from_program();
    open_file(&gate, path);
    send_entries(&gate);
    while (get_request(socket, &request)) {
        bound_work(&gate);
        send_rows(&gate, &gate.entries[request.object], &request);
    }
    _exit(0);
}
