/* Draws a model as SVG: the tree of its links, and its rows and drives. */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"
#include "gen/tree/tree.h"

#include <math.h>
#include <string.h>

/* Pixels. */
enum {
    MARGIN = 20,
    HEAD = 34,
    LINE = 16,
    PAD = 9,
    LINK_WIDTH = 250,
    ITEM_WIDTH = 270,
    GAP = 14,
    INDENT = 34,
    BETWEEN = 150
};
enum { LINES_MOST = 6, LETTERS_MOST = 36 };

/* A box with lines of text, the first one bold. */
struct box {
    double left, top, width, height;
    unsigned colour; /* of the edge */
    const char *lines[LINES_MOST];
    int line_count;
};

/* A row or a drive, and the links on which it acts. */
struct item {
    struct box box;
    bool *is_on; /* (link_count) */
};

struct drawing {
    struct generation *generation;
    const struct model *model;
    const struct tree *tree;
    struct box *links; /* (link_count + 1), the last one is the ground */
    struct item *items;
    int item_count, item_room;
    double width, height;
};

enum colour_of { COLOUR_LINK, COLOUR_BEAM, COLOUR_ROW, COLOUR_FORCE = 6 };

static unsigned colour(enum colour_of what) {
    return figures_style_quantity((int)what, 1, 0, 1).colour;
}

static double value_of(const struct drawing *drawing, expression e) {
    return parameters_evaluate(drawing->model->graph, drawing->model->parameters, e);
}

static void add_line(struct box *box, const char *text) {
    box->lines[box->line_count++] = text;
    box->height = LINE * box->line_count + 2 * PAD - 4;
}

/* ---- Links ---- */

/* "slides x y, turns psi": the joints in their order. */
static const char *joints_text(const struct link *link) {
    const char *text = link->joint_count == 0 ? "welded on" : "";
    for (int i = 0; i < link->joint_count; i++) {
        const struct joint *joint = &link->joints[i];
        const bool goes_on = i > 0 && link->joints[i - 1].is_revolute == joint->is_revolute;
        text = format_text("%s%s%s %s", text, i > 0 && !goes_on ? ", " : "",
                           goes_on              ? ""
                           : joint->is_revolute ? "turns"
                                                : "slides",
                           joint->name);
    }
    return text;
}

/* "about (0, 0.6, 0.8)": joint axes that are not axes of the link; "" if there are none. */
static const char *axis_text(const struct drawing *drawing, const struct link *link) {
    const char *text = "";
    for (int i = 0; i < link->joint_count; i++)
        if (link->joints[i].has_direction)
            text = format_text("%s%s%s %s", text, *text ? ", " : "",
                               link->joints[i].is_revolute ? "about" : "along",
                               joint_axis_text(&format_memory, drawing->model, &link->joints[i]));
    return text;
}

/* "spring z, damper z theta", or "". */
static const char *springs_text(const struct link *link) {
    const char *springs = "", *dampers = "";
    for (int i = 0; i < link->joint_count; i++) {
        const struct joint *joint = &link->joints[i];
        if (joint->stiffness)
            springs = format_text("%s %s", springs, joint->name);
        if (joint->damping)
            dampers = format_text("%s %s", dampers, joint->name);
    }
    return format_text("%s%s%s%s%s", *springs ? "spring" : "", springs, *springs && *dampers ? ", " : "",
                       *dampers ? "damper" : "", dampers);
}

/* The mass of bodies and beam, "" if there is none. */
static const char *mass_text(const struct drawing *drawing, const struct link *link) {
    double mass = 0;
    for (int i = 0; i < link->beam.segment_count; i++)
        mass += value_of(drawing, link->beam.segments[i].rho) *
                value_of(drawing, link->beam.segments[i].area) *
                value_of(drawing, link->beam.segments[i].length);
    for (int i = 0; i < link->solid_count; i++)
        mass += value_of(drawing, link->solids[i].mass);
    return mass > 0 ? format_text("%.4g kg", mass) : "";
}

static const char *beam_text(const struct drawing *drawing, const struct beam *beam) {
    double length = 0;
    int count = 0;
    for (int i = 0; i < beam->segment_count; i++) {
        length += value_of(drawing, beam->segments[i].length);
        count += beam->segments[i].rfe;
    }
    return format_text("beam of %.4g m, %d element%s", length, count, count == 1 ? "" : "s");
}

static const char *place_text(const struct attachment *on) {
    return on->where == AT_TIP ? ", on the tip" : on->where == AT_ALONG ? ", on a place along" : "";
}

static void describe_link(struct drawing *drawing, int i) {
    const struct link *link = &drawing->model->links[i];
    struct box *box = &drawing->links[i];
    *box = (struct box){.width = LINK_WIDTH, .colour = colour(link->beam.exists ? COLOUR_BEAM : COLOUR_LINK)};
    add_line(box, link->name);
    add_line(box, format_text("%s%s", joints_text(link), place_text(&link->on)));
    if (*axis_text(drawing, link))
        add_line(box, axis_text(drawing, link));
    if (*springs_text(link))
        add_line(box, springs_text(link));
    if (link->beam.exists)
        add_line(box, beam_text(drawing, &link->beam));
    if (*mass_text(drawing, link))
        add_line(box, mass_text(drawing, link));
}

/* Orders the links depth first: each follows its carrier and everything that the carrier's earlier links
 * carry. A link that shares its carrier is indented. */
static int *order_links(struct drawing *drawing) {
    const int count = drawing->model->link_count;
    const struct link *links = drawing->model->links;
    int *size = format_allocate((size_t)count + 1, sizeof *size),
        *next = format_allocate((size_t)count + 1, sizeof *next),
        *order = format_allocate((size_t)count + 1, sizeof *order),
        *children = format_allocate((size_t)count + 1, sizeof *children);
    for (int i = count - 1; i >= 0; i--) {
        const int on = links[i].on.link < 0 ? count : links[i].on.link;
        size[on] += ++size[i];
        children[on]++;
    }
    drawing->links[count].left = MARGIN;
    for (int i = 0; i < count; i++) {
        const int on = links[i].on.link < 0 ? count : links[i].on.link;
        const int place = next[on];
        next[on] += size[i];
        next[i] = place + 1;
        order[place] = i;
        drawing->links[i].left = drawing->links[on].left + (children[on] > 1 ? INDENT : 0);
    }
    return order;
}

static void place_links(struct drawing *drawing) {
    const int count = drawing->model->link_count;
    struct box *ground = &drawing->links[count];
    const int *order = order_links(drawing);
    *ground = (struct box){.left = MARGIN, .top = MARGIN + HEAD, .width = LINK_WIDTH, .colour = 0x555555};
    add_line(ground, "the ground");
    double top = ground->top + ground->height + GAP;
    for (int i = 0; i < count; i++) {
        struct box *box = &drawing->links[order[i]];
        box->top = top;
        top += box->height + GAP;
        drawing->width = fmax(drawing->width, box->left + box->width);
    }
    drawing->width = fmax(drawing->width, ground->left + ground->width);
    drawing->height = top;
}

/* ---- Rows and drives ---- */

static struct item *add_item(struct drawing *drawing, enum colour_of what, const char *title,
                             const char *kind) {
    drawing->items = memory_room(&format_memory, drawing->items, drawing->item_count, &drawing->item_room,
                                 sizeof *drawing->items);
    struct item *item = &drawing->items[drawing->item_count++];
    *item =
        (struct item){.box = {.width = ITEM_WIDTH, .colour = colour(what)},
                      .is_on = format_allocate((size_t)drawing->model->link_count + 1, sizeof *item->is_on)};
    add_line(&item->box, title);
    add_line(&item->box, kind);
    return item;
}

static void mark_link(const struct drawing *drawing, const struct item *item, int link) {
    item->is_on[link < 0 ? drawing->model->link_count : link] = true;
}

static void mark_frame(const struct drawing *drawing, const struct item *item, int frame) {
    mark_link(drawing, item, frame < 0 ? -1 : drawing->tree->frames[frame].link);
}

/* Marks the link that the author named, which may be welded to the frame's link. */
static void mark_point(const struct drawing *drawing, const struct item *item, int point) {
    mark_link(drawing, item, drawing->model->points[point].at.link);
}

/* Marks the links of the coordinates and points in an expression; returns its inputs as "" or ", input tau".
 */
static const char *mark_symbols(const struct drawing *drawing, const struct item *item, expression e) {
    int count;
    const char *inputs = "";
    const expression *symbols = rewrite_list_symbols(&drawing->generation->graph, e, &count);
    for (int i = 0; i < count; i++) {
        const struct symbol *symbol = expr_as_symbol(&drawing->generation->graph, symbols[i]);
        if (symbol->kind == SYMBOL_COORDINATE && symbol->index < tree_joint_count(drawing->tree))
            mark_frame(drawing, item, symbol->index);
        else if (symbol->kind == SYMBOL_POINT)
            mark_point(drawing, item, symbol->index / 3);
        else if (symbol->kind == SYMBOL_INPUT)
            inputs = format_text("%s%s%s", inputs, *inputs ? ", " : ", input ",
                                 drawing->model->inputs[symbol->index].name);
    }
    return inputs;
}

/* The name of a closure; its rows have one more word. */
static const char *name_of_closure(const struct row *row) {
    const char *blank = strrchr(row->name, ' ');
    return blank ? format_text("%.*s", (int)(blank - row->name), row->name) : row->name;
}

static void add_rows(struct drawing *drawing) {
    static const char *const levels[] = {"position", "velocity", "acceleration"};
    const struct model *model = drawing->model;
    for (int first = 0, end; first < model->row_count; first = end) {
        const struct row *row = &model->rows[first];
        for (end = first; end < model->row_count && model->rows[end].path == row->path; end++)
            continue;
        const int count = end - first;
        const char *title = count > 1 ? name_of_closure(row) : row->name;
        const struct item *item =
            add_item(drawing, COLOUR_ROW, title,
                     format_text("%d row%s of %s", count, count > 1 ? "s" : "", levels[row->level]));
        for (int i = first; i < end; i++)
            mark_symbols(drawing, item, model->rows[i].residual);
    }
}

/* The inputs of a force. Only the link on which it acts is marked, not what else its formula depends on. */
static const char *inputs_of(const struct drawing *drawing, const expression *values, int count) {
    const struct item aside = {
        .is_on = format_allocate((size_t)drawing->model->link_count + 1, sizeof *aside.is_on)};
    const char *inputs = "";
    for (int i = 0; i < count; i++) {
        const char *more = mark_symbols(drawing, &aside, values[i]);
        inputs = *inputs ? inputs : more;
    }
    return inputs;
}

static void add_forces(struct drawing *drawing) {
    const struct model *model = drawing->model;
    for (int i = 0; i < model->force_count - model->state_count; i++) {
        const struct frame *frame = &drawing->tree->frames[model->forces[i].coordinate];
        const char *kind = frame->joint.is_revolute ? "torque" : "force";
        const struct item *item =
            add_item(drawing, COLOUR_FORCE, format_text("%s on %s", kind, frame->name),
                     format_text("drive%s", inputs_of(drawing, &model->forces[i].value, 1)));
        mark_frame(drawing, item, model->forces[i].coordinate);
    }
    for (int i = 0; i < model->load_count; i++) {
        const struct load *load = &model->loads[i];
        const struct item *item =
            add_item(drawing, COLOUR_FORCE,
                     format_text("%s %s", load->is_torque ? "torque on the body of" : "force at",
                                 model->points[load->point].name),
                     format_text("load%s", inputs_of(drawing, load->value, 3)));
        mark_point(drawing, item, load->point);
    }
    for (int i = 0; i < model->potential_count; i++) {
        const struct item *item = add_item(drawing, COLOUR_FORCE, model->potentials[i].path, "energy");
        mark_symbols(drawing, item, model->potentials[i].energy);
    }
}

static void place_items(struct drawing *drawing) {
    double top = MARGIN + HEAD;
    for (int i = 0; i < drawing->item_count; i++) {
        struct box *box = &drawing->items[i].box;
        box->left = drawing->width + BETWEEN;
        box->top = top;
        top += box->height + GAP;
    }
    if (drawing->item_count > 0)
        drawing->width += BETWEEN + ITEM_WIDTH;
    drawing->height = fmax(drawing->height, top);
}

/* ---- SVG ---- */

static void put_label(FILE *out, double x, double y, const char *how, const char *text) {
    const char *end = text;
    for (int i = 0; i < LETTERS_MOST && *end; i++)
        format_utf8_next(&end);
    fprintf(out, "<text x=\"%g\" y=\"%g\"%s>", x, y, how);
    format_xml_text(out, format_text("%.*s%s", (int)(end - text), text, *end ? "..." : ""));
    fputs("</text>\n", out);
}

static void put_box(FILE *out, const struct box *box) {
    fprintf(out,
            "<rect x=\"%g\" y=\"%g\" width=\"%g\" height=\"%g\" rx=\"5\" fill=\"#ffffff\" stroke=\"#%06x\" "
            "stroke-width=\"1.6\"/>\n",
            box->left, box->top, box->width, box->height, box->colour);
    for (int i = 0; i < box->line_count; i++)
        put_label(out, box->left + PAD, box->top + PAD + 9 + LINE * i,
                  i == 0 ? " font-weight=\"bold\"" : " fill=\"#555555\"", box->lines[i]);
}

/* Draws a line from the carrier down, and to the side of the link if it is indented. */
static void put_branch(FILE *out, const struct box *on, const struct box *link) {
    const double x = on->left + 0.5 * INDENT, bottom = on->top + on->height;
    fprintf(out, "<path d=\"M%g %gV%g", x, bottom,
            link->left > on->left ? link->top + 0.5 * link->height : link->top);
    if (link->left > on->left)
        fprintf(out, "H%g", link->left);
    fputs("\" fill=\"none\" stroke=\"#555555\" stroke-width=\"1.4\"/>\n", out);
}

static void put_tie(FILE *out, const struct box *link, const struct box *item) {
    const double x = link->left + link->width, y = link->top + 0.5 * link->height,
                 y_end = item->top + 0.5 * item->height;
    const double middle = 0.5 * (x + item->left);
    fprintf(out,
            "<path d=\"M%g %gC%g %g %g %g %g %g\" fill=\"none\" stroke=\"#%06x\" stroke-width=\"1.2\"/>\n", x,
            y, middle, y, middle, y_end, item->left, y_end, item->colour);
}

static void put_lines(FILE *out, const struct drawing *drawing) {
    const int count = drawing->model->link_count;
    for (int i = 0; i < count; i++) {
        const int on = drawing->model->links[i].on.link;
        put_branch(out, &drawing->links[on < 0 ? count : on], &drawing->links[i]);
    }
    for (int i = 0; i < drawing->item_count; i++)
        for (int k = 0; k <= count; k++)
            if (drawing->items[i].is_on[k])
                put_tie(out, &drawing->links[k], &drawing->items[i].box);
}

static void put_svg(FILE *out, const struct drawing *drawing) {
    const int count = drawing->model->link_count;
    const double width = drawing->width + MARGIN, height = drawing->height + MARGIN - GAP;
    fprintf(
        out,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" "
        "height=\"%g\" viewBox=\"0 0 %g %g\" font-family=\"Helvetica, Arial, sans-serif\" "
        "font-size=\"12\">\n",
        width, height, width, height);
    fprintf(out, "<rect width=\"%g\" height=\"%g\" fill=\"#ffffff\"/>\n", width, height);
    put_label(out, MARGIN, MARGIN + 12, " font-size=\"15\" font-weight=\"bold\"",
              format_text("%s: %d coordinate%s, %d row%s", drawing->model->name,
                          tree_joint_count(drawing->tree), tree_joint_count(drawing->tree) == 1 ? "" : "s",
                          drawing->model->row_count, drawing->model->row_count == 1 ? "" : "s"));
    put_lines(out, drawing);
    for (int i = 0; i <= count; i++)
        put_box(out, &drawing->links[i]);
    for (int i = 0; i < drawing->item_count; i++)
        put_box(out, &drawing->items[i].box);
    fputs("</svg>\n", out);
}

void view_model_drawing_put(FILE *out, struct generation *generation) {
    struct drawing drawing = {
        .generation = generation, .model = &generation->model, .tree = &generation->tree};
    drawing.links = format_allocate((size_t)generation->model.link_count + 1, sizeof *drawing.links);
    for (int i = 0; i < generation->model.link_count; i++)
        describe_link(&drawing, i);
    place_links(&drawing);
    add_rows(&drawing);
    add_forces(&drawing);
    place_items(&drawing);
    put_svg(out, &drawing);
}
