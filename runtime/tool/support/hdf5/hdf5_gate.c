/*
 * The gate process, which reads HDF5 files for the program.
 *
 * The library crashes on some damaged files, and follows links to other files. The gate therefore checks
 * every object before it reads any of its data. If it crashes, the program reports a damaged file.
 *
 * The gate refuses:
 * - links to other files and names, and two names of one object;
 * - data in other files (external, virtual), and filters that are not HDF5's own;
 * - data that are missing or cannot fit into the file;
 * - names that are not UTF-8, and scales along which a dataset is missing.
 */
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/hdf5/hdf5_private.h"
#include "runtime/tool/support/system/system.h"

/* ---- Answers ---- */

enum {
    GATE_SECONDS = 1,               /* CPU time that a request may use [s] */
    GATE_BYTES_PER_SECOND = 1000000 /* it may use 1 s more for this many bytes of the file */
};

/* The program receives each answer whole. If the gate cannot answer, it sends a fact instead and ends. */
struct answers {
    FILE *out;    /* to the program */
    FILE *stream; /* the answer that is being written, into `text` */
    char *text;
    size_t length;
    double bytes;     /* size of the file that is read */
    double text_left; /* bytes of texts that the present request may still use */
};

static void answers_put_whole(struct answers *answers, int64_t number) {
    fwrite(&number, sizeof number, 1, answers->stream);
}

static void answers_put_bytes(struct answers *answers, const char *text, size_t length) {
    answers_put_whole(answers, (int64_t)length);
    fwrite(text, 1, length, answers->stream);
}

static void answers_begin(struct answers *answers, enum gate_answer answer) {
    answers->stream = format_stream(&answers->text, &answers->length);
    answers_put_whole(answers, answer);
}

static void answers_end(struct answers *answers) {
    fclose(answers->stream);
    if (fwrite(answers->text, 1, answers->length, answers->out) != answers->length ||
        fflush(answers->out) != 0)
        _exit(1);
    free(answers->text);
}

/* Sends the fact and ends the process. */
static _Noreturn void answers_refuse(struct answers *answers, const char *format, ...) {
    va_list list;
    va_start(list, format);
    const char *text = format_vtext(format, list);
    va_end(list);
    answers_begin(answers, GATE_FACT);
    answers_put_bytes(answers, text, strlen(text));
    answers_end(answers);
    _exit(0);
}

static hid_t answers_good(struct answers *answers, const char *path, hid_t result) {
    if (result < 0)
        answers_refuse(answers, "damaged: %s: %s", path, hdf5_cause());
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

/* Lengths in a damaged file may request any amount of memory. If the system does not say how much this
 * process has, only the limits on texts apply. */
static void bound_memory(const struct answers *answers) {
    const double more = 1e9 + 4 * answers->bytes;
    unsigned long long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%llu", &pages) == 1)
        bound(RLIMIT_AS, (rlim_t)((double)pages * (double)sysconf(_SC_PAGESIZE) + more));
    if (file)
        fclose(file);
}

/* Limits the work of the next request. */
static void answers_bound_work(struct answers *answers) {
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    bound(RLIMIT_CPU, (rlim_t)(used.ru_utime.tv_sec + used.ru_stime.tv_sec + 1 + GATE_SECONDS) +
                          (rlim_t)(answers->bytes / GATE_BYTES_PER_SECOND));
    answers->text_left = answers->bytes;
}

/* Answers go through the socket and concern the file `path`. Limits memory, and the work until the first
 * request. */
static void answers_start(struct answers *answers, const char *path, int socket) {
    struct stat status;
    *answers = (struct answers){.out = fdopen(socket, "w")};
    if (!answers->out)
        _exit(1);
    answers->bytes = stat(path, &status) == 0 ? (double)status.st_size : 0;
    bound(RLIMIT_CORE, 0);
    bound_memory(answers);
    answers_bound_work(answers);
}

/* An object of the file. Its path begins with a slash. */
struct entry {
    const char *path;
    haddr_t address;
    H5O_type_t type;
    int group;     /* its number */
    hid_t dataset; /* open; negative: there is none, or it was not needed yet */
    enum hdf5_kind kind;
    int rank;
    hsize_t size[2]; /* rows, and numbers in a row; 0 for a dataset with one axis */
};

/* The place of an entry in the file. */
struct entry_address {
    haddr_t address;
    int entry;
};

enum {
    DEEPEST = 32,      /* depth of groups in groups */
    MOST_PACKED = 1100 /* how many bytes one byte of a file may become; zlib reaches at most 1032 */
};

struct gate {
    struct answers *answers;
    hid_t file;
    struct entry *entries;
    int count, room;
    struct entry_address *places; /* (count) places of the entries, in order */
};

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
    return format_text("%s/%s", strcmp(group, "/") == 0 ? "" : group, name);
}

static herr_t take_link(hid_t group, const char *name, const H5L_info_t *info, void *where) {
    struct names *names = where;
    const char *path = path_of(names->path, name);
    (void)group;
    if (!is_utf8(name, strlen(name)))
        answers_refuse(names->gate->answers, "damaged: a name in %s is not UTF-8", names->path);
    if (info->type == H5L_TYPE_EXTERNAL)
        answers_refuse(names->gate->answers, "%s: is a link to another file, which is not followed", path);
    if (info->type != H5L_TYPE_HARD)
        answers_refuse(names->gate->answers, "%s: is a link to another name, which is not followed", path);
    names->list = memory_room(&format_memory, names->list, names->count, &names->room, sizeof *names->list);
    names->list[names->count++] = path;
    return 0;
}

/* In the order of creation, if the group keeps it. */
static struct names list_names(struct gate *gate, const char *path) {
    struct names names = {.gate = gate, .path = path};
    if (H5Literate_by_name(gate->file, path, H5_INDEX_CRT_ORDER, H5_ITER_INC, NULL, take_link, &names,
                           H5P_DEFAULT) >= 0)
        return names;
    names.count = 0;
    answers_good(gate->answers, path,
                 H5Literate_by_name(gate->file, path, H5_INDEX_NAME, H5_ITER_INC, NULL, take_link, &names,
                                    H5P_DEFAULT));
    return names;
}

static int add_entry(struct gate *gate, const char *path, int group) {
    H5O_info_t info;
    answers_good(gate->answers, path,
                 H5Oget_info_by_name2(gate->file, path, &info, H5O_INFO_BASIC, H5P_DEFAULT));
    if (group >= 0 && info.rc != 1)
        answers_refuse(gate->answers, "%s: has %u names in the file; it must have one", path, info.rc);
    gate->entries =
        memory_room(&format_memory, gate->entries, gate->count, &gate->room, sizeof *gate->entries);
    gate->entries[gate->count] =
        (struct entry){.path = path, .address = info.addr, .type = info.type, .group = group, .dataset = -1};
    return gate->count++;
}

/* Adds the content of a group after the group. */
static void add_entries(struct gate *gate, int group, int depth) {
    const char *path = gate->entries[group].path;
    const struct names names = list_names(gate, path);
    if (depth == DEEPEST)
        answers_refuse(gate->answers, "%s: lies more than %d groups deep", path, (int)DEEPEST);
    for (int i = 0; i < names.count; i++) {
        const int entry = add_entry(gate, names.list[i], group);
        if (gate->entries[entry].type == H5O_TYPE_GROUP)
            add_entries(gate, entry, depth + 1);
    }
}

static int compare_places(const void *a, const void *b) {
    const haddr_t x = ((const struct entry_address *)a)->address,
                  y = ((const struct entry_address *)b)->address;
    return x < y ? -1 : x > y;
}

static void sort_places(struct gate *gate) {
    gate->places = format_allocate((size_t)gate->count, sizeof *gate->places);
    for (int i = 0; i < gate->count; i++)
        gate->places[i] = (struct entry_address){gate->entries[i].address, i};
    qsort(gate->places, (size_t)gate->count, sizeof *gate->places, compare_places);
    for (int i = 1; i < gate->count; i++)
        if (gate->places[i].address == gate->places[i - 1].address)
            answers_refuse(gate->answers, "damaged: %s and %s are one object",
                           gate->entries[gate->places[i - 1].entry].path,
                           gate->entries[gate->places[i].entry].path);
}

/* The entry that a reference leads to; `what` names it in messages. */
static const struct entry *referred(struct gate *gate, const char *path, const char *what,
                                    hobj_ref_t reference) {
    const struct entry_address key = {.address = reference};
    const struct entry_address *place =
        bsearch(&key, gate->places, (size_t)gate->count, sizeof key, compare_places);
    if (!place)
        answers_refuse(gate->answers, "%s: %s is missing", path, what);
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

/* Checks that the file has the data of `count` elements, packed no more than HDF5's filters can. */
static void check_fit(struct gate *gate, const char *path, double count, hid_t type) {
    if (count * (double)H5Tget_size(type) > MOST_PACKED * gate->answers->bytes)
        answers_refuse(gate->answers, "damaged: %s: %.0f values do not fit into a file of %.0f bytes", path,
                       count, gate->answers->bytes);
}

/* `count` texts in the form of the memory type: pointers, of which an empty one may be NULL, or fields of one
 * length. */
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
        answers_put_bytes(gate->answers, text ? text : "", length);
    }
}

/* ---- Attributes ---- */

/* Attributes of an open entry. */
struct attribute {
    hid_t id, type;
    hssize_t length; /* values */
    bool is_list;
};

static struct attribute open_attribute(struct gate *gate, const char *path, const char *name) {
    struct attribute attribute = {
        .id = answers_good(gate->answers, path,
                           H5Aopen_by_name(gate->file, path, name, H5P_DEFAULT, H5P_DEFAULT))};
    const hid_t space = answers_good(gate->answers, path, H5Aget_space(attribute.id));
    attribute.type = answers_good(gate->answers, path, H5Aget_type(attribute.id));
    attribute.length = H5Sget_simple_extent_npoints(space);
    attribute.is_list = H5Sget_simple_extent_ndims(space) > 0;
    H5Sclose(space);
    answers_good(gate->answers, path, attribute.length < 0 ? -1 : 0);
    check_fit(gate, path, (double)attribute.length, attribute.type);
    return attribute;
}

static void close_attribute(struct attribute *attribute) {
    H5Tclose(attribute->type);
    H5Aclose(attribute->id);
}

/* In heap memory, in the form of `type`. */
static void *read_attribute(struct gate *gate, const char *path, const struct attribute *attribute,
                            hid_t type) {
    void *values = format_allocate_large((size_t)attribute->length + 1, H5Tget_size(type));
    if (attribute->length > 0)
        answers_good(gate->answers, path, H5Aread(attribute->id, type, values));
    return values;
}

static void send_attribute(struct gate *gate, const char *path, const char *name) {
    struct attribute attribute = open_attribute(gate, path, name);
    const enum hdf5_kind kind = kind_of(attribute.type);
    if (kind != HDF5_OTHER) {
        const hid_t type = kind == HDF5_TEXTS ? attribute.type : H5T_NATIVE_DOUBLE;
        void *values = read_attribute(gate, path, &attribute, type);
        answers_put_whole(gate->answers, kind);
        answers_put_bytes(gate->answers, name, strlen(name));
        answers_put_whole(gate->answers, attribute.is_list ? attribute.length : GATE_SINGLE);
        if (kind == HDF5_TEXTS)
            send_texts(gate, type, values, (size_t)attribute.length);
        else
            fwrite(values, sizeof(double), (size_t)attribute.length, gate->answers->stream);
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
    answers_good(gate->answers, path,
                 H5Aiterate_by_name(gate->file, path, H5_INDEX_NAME, H5_ITER_INC, NULL, take_attribute,
                                    &described, H5P_DEFAULT));
    answers_put_whole(gate->answers, GATE_NO_MORE);
}

/* ---- Dimension scales ---- */

static bool has_attribute(struct gate *gate, const char *path, const char *name) {
    return answers_good(gate->answers, path, H5Aexists_by_name(gate->file, path, name, H5P_DEFAULT)) > 0;
}

/* The path of the scale along the second axis; "" if there is none. */
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

/* A scale lists the datasets along it; all of them must exist. */
static void check_datasets_along(struct gate *gate, const char *path) {
    static const char name[] = "REFERENCE_LIST";
    if (!has_attribute(gate, path, name))
        return;
    struct attribute attribute = open_attribute(gate, path, name);
    const hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(hobj_ref_t));
    answers_good(gate->answers, path, H5Tinsert(type, "dataset", 0, H5T_STD_REF_OBJ));
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
            answers_refuse(gate->answers, "%s: its data are packed by filter %d, which refdyn does not know",
                           path, filter);
    }
}

/* Call it before any request for the size, which would open the files of a virtual dataset. */
static bool check_storage(struct gate *gate, const char *path, hid_t dataset) {
    const hid_t creation = answers_good(gate->answers, path, H5Dget_create_plist(dataset));
    const H5D_layout_t layout = H5Pget_layout(creation);
    if (layout == H5D_VIRTUAL || H5Pget_external_count(creation) != 0)
        answers_refuse(gate->answers, "%s: its data lie in other files, which are not followed", path);
    check_filters(gate, path, creation);
    const bool is_packed = H5Pget_nfilters(creation) > 0;
    H5Pclose(creation);
    return is_packed;
}

static void check_data(struct gate *gate, const struct entry *entry, hid_t type, hid_t space,
                       bool is_packed) {
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    answers_good(gate->answers, entry->path, count < 0 ? -1 : 0);
    check_fit(gate, entry->path, (double)count, type);
    const double stored = (double)H5Dget_storage_size(entry->dataset),
                 needed = (double)count * (double)H5Tget_size(type);
    if (stored < (is_packed ? fmin(needed, 1) : needed))
        answers_refuse(gate->answers, "damaged: %s: data are missing", entry->path);
}

/* Opens the dataset, and determines its kind and its sizes. */
static void look_at_dataset(struct gate *gate, struct entry *entry) {
    entry->dataset = answers_good(gate->answers, entry->path, H5Dopen2(gate->file, entry->path, H5P_DEFAULT));
    const bool is_packed = check_storage(gate, entry->path, entry->dataset);
    const hid_t type = answers_good(gate->answers, entry->path, H5Dget_type(entry->dataset)),
                space = answers_good(gate->answers, entry->path, H5Dget_space(entry->dataset));
    entry->rank = (int)answers_good(gate->answers, entry->path, H5Sget_simple_extent_ndims(space));
    entry->kind = kind_of(type);
    if (entry->kind != HDF5_OTHER)
        check_data(gate, entry, type, space, is_packed);
    if (entry->rank == 1 || entry->rank == 2)
        H5Sget_simple_extent_dims(space, entry->size, NULL);
    H5Sclose(space);
    H5Tclose(type);
}

/* Call it before reading any attribute: a fault in another object may cause an error here. */
static void look_at_entries(struct gate *gate) {
    for (int i = 0; i < gate->count; i++) {
        struct entry *entry = &gate->entries[i];
        if (entry->type == H5O_TYPE_DATASET)
            look_at_dataset(gate, entry);
        else if (entry->type != H5O_TYPE_GROUP)
            answers_refuse(gate->answers, "%s: is neither a group nor a dataset", entry->path);
    }
}

static void send_entry(struct gate *gate, const struct entry *entry) {
    answers_begin(gate->answers, GATE_OBJECT);
    answers_put_whole(gate->answers, entry->group);
    answers_put_whole(gate->answers, entry->kind);
    answers_put_whole(gate->answers, entry->rank);
    answers_put_whole(gate->answers, (int64_t)entry->size[0]);
    answers_put_whole(gate->answers, (int64_t)entry->size[1]);
    answers_put_bytes(gate->answers, entry->path, strlen(entry->path));
    const char *axis = find_axis(gate, entry->path);
    answers_put_bytes(gate->answers, axis, strlen(axis));
    check_datasets_along(gate, entry->path);
    send_attributes(gate, entry->path);
    answers_end(gate->answers);
}

static void send_entries(struct gate *gate) {
    add_entry(gate, "/", -1);
    add_entries(gate, 0, 0);
    sort_places(gate);
    look_at_entries(gate);
    for (int i = 0; i < gate->count; i++)
        send_entry(gate, &gate->entries[i]);
    answers_begin(gate->answers, GATE_END);
    answers_end(gate->answers);
}

/* ---- Rows ---- */

static hid_t select_rows(struct gate *gate, const struct entry *entry, const struct gate_request *request) {
    const hsize_t start[2] = {(hsize_t)request->first, 0},
                  count[2] = {(hsize_t)request->count, entry->size[1]};
    const hid_t space = answers_good(gate->answers, entry->path, H5Dget_space(entry->dataset));
    answers_good(gate->answers, entry->path,
                 H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL));
    return space;
}

/* Allocates the texts of a dataset for HDF5. */
static void *allocate_text(size_t size, void *where) {
    struct answers *answers = where;
    if ((double)size > answers->text_left + 1)
        return NULL;
    answers->text_left -= (double)size;
    return malloc(size + 1);
}

static void free_text(void *text, void *where) {
    (void)where;
    free(text);
}

static void read_rows(struct gate *gate, const struct entry *entry, const struct gate_request *request,
                      hid_t type, void *values) {
    const hsize_t count = (hsize_t)request->count * (entry->size[1] > 0 ? entry->size[1] : 1);
    const hid_t memory = H5Screate_simple(1, &count, NULL), stored = select_rows(gate, entry, request);
    const hid_t transfer = H5Pcreate(H5P_DATASET_XFER);
    H5Pset_vlen_mem_manager(transfer, allocate_text, gate->answers, free_text, NULL);
    answers_good(gate->answers, entry->path, H5Dread(entry->dataset, type, memory, stored, transfer, values));
    H5Pclose(transfer);
    H5Sclose(stored);
    H5Sclose(memory);
}

static void send_rows(struct gate *gate, const struct entry *entry, const struct gate_request *request) {
    const size_t count = (size_t)request->count * (entry->size[1] > 0 ? (size_t)entry->size[1] : 1);
    const hid_t stored = answers_good(gate->answers, entry->path, H5Dget_type(entry->dataset)),
                type = entry->kind == HDF5_TEXTS ? stored : H5T_NATIVE_DOUBLE;
    void *values = format_allocate_large(count + 1, H5Tget_size(type));
    read_rows(gate, entry, request, type, values);
    answers_begin(gate->answers, GATE_ROWS);
    if (entry->kind == HDF5_TEXTS)
        send_texts(gate, type, values, count);
    else
        fwrite(values, sizeof(double), count, gate->answers->stream);
    for (size_t i = 0; entry->kind == HDF5_TEXTS && H5Tis_variable_str(type) > 0 && i < count; i++)
        free(((char **)values)[i]);
    free(values);
    H5Tclose(stored);
    answers_end(gate->answers);
}

/* ---- The process ---- */

static bool get_request(int socket, struct gate_request *request) {
    return recv(socket, request, sizeof *request, MSG_WAITALL) == (ssize_t)sizeof *request;
}

/* A signal that ends the program closes the other end of the socket, which ends this process. The user does
 * not see what the library and the allocator print about a damaged file. */
static void part_from_program(int socket) {
    const int ignored[] = {SIGHUP, SIGINT, SIGPIPE}, ending[] = {SIGTERM, SIGXCPU, SIGXFSZ};
    for (size_t i = 0; i < sizeof ignored / sizeof ignored[0]; i++)
        signal(ignored[i], SIG_IGN);
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++)
        signal(ending[i], SIG_DFL);
    system_process_leave_descriptors(socket);
}

static void open_file(struct gate *gate, const char *path) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5dont_atexit();
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    H5PLset_loading_state(0);
    H5Pset_file_locking(access, false, true);
    gate->file = H5Fopen(path, H5F_ACC_RDONLY, access);
    if (gate->file < 0)
        answers_refuse(gate->answers, "cannot be read: %s", hdf5_cause());
    H5Pclose(access);
}

void hdf5_gate_serve(const char *path, int socket) {
    struct answers answers;
    struct gate gate = {.answers = &answers};
    struct gate_request request;
    answers_start(&answers, path, socket);
    part_from_program(socket);
    open_file(&gate, path);
    send_entries(&gate);
    while (get_request(socket, &request)) {
        answers_bound_work(&answers);
        send_rows(&gate, &gate.entries[request.object], &request);
    }
    _exit(0);
}
