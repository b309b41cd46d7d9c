/* The page of `refdyn view` as HTML. */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <math.h>

/* Texts of page/, embedded by the build. */
extern const char view_body[], view_style[], view_three_licence[], view_motion[], view_camera[],
    view_shapes[], view_scene[], view_charts[], view_controls[], view_start[];

/* Nothing may be loaded, from wherever it is. */
static const char policy[] = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
                             "script-src 'unsafe-inline'; style-src 'unsafe-inline'\">\n";

char *view_page_read_three(void) {
    const char *own = getenv("REFDYN_THREE");
    const char *path = own && *own ? own : "/usr/share/javascript/three/three.min.js";
    if (access(path, R_OK) == 0)
        return read_text(path, "three.js");
    fprintf(stderr,
            "refdyn: %s: %s; three.js is needed (Debian: apt install libjs-three; REFDYN_THREE names its "
            "file elsewhere)\n",
            path, strerror(errno));
    return NULL;
}

static void put_script(FILE *out, const char *text) {
    fprintf(out, "<script>\n%s</script>\n", text);
}

/* Inside a script element "<" might end it; in JSON it is in texts alone. */
static void put_data(FILE *out, const char *data) {
    fputs("<script type=\"application/json\" id=\"data\">\n", out);
    for (const char *at = data; *at; at++)
        if (*at == '<')
            fputs("\\u003c", out);
        else
            fputc(*at, out);
    fputs("\n</script>\n", out);
}

void view_page_put(FILE *out, const char *title, const char *three, const char *data) {
    static const char *const scripts[] = {view_motion, view_camera,   view_shapes, view_scene,
                                          view_charts, view_controls, view_start};
    fprintf(out, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n%s", policy);
    fputs("<meta name=\"viewport\" content=\"width=device-width\">\n<title>", out);
    put_xml_text(out, title);
    fprintf(out, "</title>\n<style>\n%s</style>\n</head>\n<body>\n%s", view_style, view_body);
    put_data(out, data);
    fprintf(out, "<!--\n%s-->\n<script>\n%s\n</script>\n", view_three_licence, three);
    for (size_t i = 0; i < sizeof scripts / sizeof *scripts; i++)
        put_script(out, scripts[i]);
    fputs("</body>\n</html>\n", out);
}

/* ---- Numbers of a page ---- */

void view_put_length(FILE *out, double value) {
    fprintf(out, "%.7g", isfinite(value) ? value + 0.0 : 0);
}

void view_put_cosine(FILE *out, double value) {
    const double unit = 1e8, rounded = round(value * unit) / unit;
    view_put_length(out, rounded == 0 ? 0 : rounded); /* no -0 */
}

double view_rounded_unit(double largest, int digits) {
    return largest > 0 && isfinite(largest) ? pow(10, floor(log10(largest)) + 1 - digits) : 1;
}

void view_put_course(FILE *out, const double *values, long count, long stride, double unit) {
    long long before = 0;
    fputc('[', out);
    for (long i = 0; i < count; i++) {
        const long long now = llround(values[i * stride] / unit);
        fprintf(out, "%s%lld", i ? "," : "", now - before);
        before = now;
    }
    fputc(']', out);
}
