/* picture_legend.c: draws the scale of a picture's colours. */
#include "picture/picture_legend.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/text.h"
#include "picture/picture_body.h"
#include "cli/path.h"

/* Rounds up to the next of `steps` (ascending, in [1, 10)) times a power of ten. */
static double round_up(double value, int count, const double *steps)
{
  double power = pow(10, floor(log10(value)));
  for (int k = 0; k < count; k++)
    if (value <= 1.0000001 * steps[k] * power) return steps[k] * power;
  return 10 * power;
}

void flesh_picture_range(flesh_picture_field field, double least, double most, double *low, double *high)
{
  /* With these values, the ends of J's range and its 1, and the ends of all other ranges, are marked. */
  static const double about_one[] = {1, 1.5, 2, 3, 4, 5, 6}, from_zero[] = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8};
  const int any = most >= least;
  if (field == FLESH_PICTURE_J) {
    double reach = any ? fmax(1 - least, most - 1) : 0.5;
    reach = round_up(fmin(fmax(reach, 0.01), 0.5), sizeof about_one / sizeof *about_one, about_one);
    *low = 1 - reach;
    *high = 1 + reach;
  } else {
    *low = 0;
    *high = any && most > 0 ? round_up(most, sizeof from_zero / sizeof *from_zero, from_zero) : 1;
  }
}

/* Finds the first and last multiple of the step within the range, whose ends rounding may overshoot. Returns their
 * number. */
static int multiples(double low, double high, double step, double *first, double *last)
{
  *first = ceil(low / step - 1e-6);
  *last = floor(high / step + 1e-6);
  return (int)fmin(*last - *first + 1, 1e6);
}

static int hits_ends(double low, double high, double step, double first, double last)
{
  return fabs(first * step - low) < 1e-5 * step && fabs(last * step - high) < 1e-5 * step;
}

int flesh_picture_ticks(double low, double high, int room, double *ticks, int *decimals)
{
  static const double steps[] = {1, 2, 2.5, 5};
  const double power = floor(log10((high - low) / room));
  double best = 0, first, last;
  for (int k = 0; k < 12; k++) { /* takes the finest step that fits, or a coarser one below 5 times it that hits both ends */
    double step = steps[k % 4] * pow(10, power + k / 4);
    int count = multiples(low, high, step, &first, &last);
    if (count > room || count < 2) continue;
    if (!(best > 0)) best = step;
    if (count >= 3 && step < 5 * best && hits_ends(low, high, step, first, last)) {
      best = step;
      break;
    }
  }
  if (!(best > 0)) { /* there are not even two multiples: marks the ends themselves */
    ticks[0] = low, ticks[1] = high;
    *decimals = (int)fmin(fmax(3 - power, 0), 12);
    return 2;
  }
  int count = multiples(low, high, best, &first, &last);
  for (int k = 0; k < count; k++) ticks[k] = (first + k) * best + 0.0; /* no -0 */
  const double exponent = floor(log10(best) + 1e-9);
  const int half = fabs(best / pow(10, exponent) - 2.5) < 1e-6;
  *decimals = (int)fmin(fmax(half - exponent, 0), 12);
  return count;
}

/* Returns a power of a thousand and its prefix. */
static double unit_of(flesh_picture_field field, const flesh_picture_frame *frame, const char **prefix)
{
  static const char *const prefixes[] = {"n", "µ", "m", "", "k", "M", "G", "T"};
  const double largest = fmax(fabs(frame->low), fabs(frame->high));
  *prefix = "";
  if (field == FLESH_PICTURE_J || !(largest > 0)) return 1;
  const double thousands = fmin(fmax(floor(log10(largest * 1.0000001) / 3), -3), field == FLESH_PICTURE_SPEED ? 1 : 4);
  *prefix = prefixes[(int)thousands + 3];
  return pow(1000, thousands);
}

/* Names of the quantities in two lines; the second also gets the unit with its prefix. */
static const struct {
  const char *first, *second, *unit;
} words[] = {{"", "", NULL}, {"volume ratio", "J_mean", NULL}, {"von Mises", "stress ", "Pa"}, {"speed", "", "m/s"},
             {"Young's", "modulus ", "Pa"}, {"error of", "the mesh ", "m"}};
static_assert(sizeof words / sizeof *words == FLESH_PICTURE_FIELDS, "words for every field");

static void print_second(flesh_picture_field field, const char *prefix, char text[48])
{
  const char *unit = words[field].unit;
  if (unit) snprintf(text, 48, "%s[%s%s]", words[field].second, prefix, unit);
  else snprintf(text, 48, "%s", words[field].second);
}

void flesh_picture_quantity(flesh_picture_field field, const flesh_picture_frame *frame, char text[64], double *unit)
{
  const char *prefix;
  char second[48];
  *unit = unit_of(field, frame, &prefix);
  print_second(field, prefix, second);
  snprintf(text, 64, "%s%s%.40s", words[field].first, *second ? " " : "", second);
}

enum { LONGEST_TEXT = 512 };

/* Returns the text cut to LONGEST_TEXT bytes, without bytes that are not UTF-8, which cairo refuses to draw. */
static const char *drawable(const char *text, char room[LONGEST_TEXT])
{
  *room = 0;
  flesh_text_add(room, LONGEST_TEXT, "%s", text);
  flesh_text_mend(room, strlen(room));
  return room;
}

void flesh_picture_text(cairo_t *c, double x, double y, double align, double size, double grey, const char *text)
{
  char room[LONGEST_TEXT];
  cairo_set_source_rgb(c, grey, grey, grey);
  cairo_move_to(c, x - align * flesh_picture_text_width(c, size, text), y);
  cairo_show_text(c, drawable(text, room));
}

double flesh_picture_text_width(cairo_t *c, double size, const char *text)
{
  cairo_text_extents_t extents;
  char room[LONGEST_TEXT];
  cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(c, size);
  cairo_text_extents(c, drawable(text, room), &extents);
  return extents.x_advance;
}

enum { BAR_WIDTH = 14, CAP = 7, LINE = 15 };

/* Draws a cap, which says that there are values beyond the scale. */
static void draw_cap(cairo_t *c, double x, double y, double to, const double rgb[3])
{
  cairo_set_source_rgb(c, rgb[0], rgb[1], rgb[2]);
  cairo_move_to(c, x, y);
  cairo_line_to(c, x + BAR_WIDTH, y);
  cairo_line_to(c, x + 0.5 * BAR_WIDTH, to);
  cairo_close_path(c);
  cairo_fill(c);
}

static void draw_bar(cairo_t *c, double x, double y, double height, flesh_picture_field field,
                     const flesh_picture_frame *frame, double unit)
{
  double rgb[3], ticks[FLESH_LEGEND_TICKS];
  int decimals, room = (int)fmin(fmax(1 + height / 16, 2), 9);
  for (int k = 0; k < (int)height; k++) {
    flesh_picture_colour(field, 1 - (k + 0.5) / height, rgb);
    cairo_set_source_rgb(c, rgb[0], rgb[1], rgb[2]);
    cairo_rectangle(c, x, y + k, BAR_WIDTH, 1);
    cairo_fill(c);
  }
  flesh_picture_colour(field, 1, rgb);
  if (frame->most > frame->high) draw_cap(c, x, y, y - CAP, rgb);
  flesh_picture_colour(field, 0, rgb);
  if (frame->least < frame->low) draw_cap(c, x, y + height, y + height + CAP, rgb);
  int count = flesh_picture_ticks(frame->low / unit, frame->high / unit, room, ticks, &decimals);
  for (int k = 0; k < count; k++) {
    char text[48];
    double part = (ticks[k] * unit - frame->low) / (frame->high - frame->low), at = y + height * (1 - part);
    if (fabs(ticks[k]) >= 1e6) snprintf(text, sizeof text, "%.6g", ticks[k]);
    else snprintf(text, sizeof text, "%.*f", decimals, ticks[k]);
    cairo_set_source_rgb(c, 0.45, 0.45, 0.45);
    cairo_rectangle(c, x + BAR_WIDTH, floor(fmin(at, y + height - 1)), 3, 1);
    cairo_fill(c);
    flesh_picture_text(c, x + BAR_WIDTH + 6, at + 4, 0, 11, 0.2, text);
  }
}

void flesh_picture_legend(cairo_t *c, double x, double y, double height, flesh_picture_field field,
                          const flesh_picture_frame *frame)
{
  enum { LONGEST = 240 };
  char text[48];
  const char *prefix;
  const double unit = unit_of(field, frame, &prefix);
  const double around = 4 * LINE + 2 * CAP + 8 + (frame->inverted ? LINE + 3 : 0);
  const double length = floor(fmin(height - around, LONGEST));
  double at = floor(y - 0.5 * (length + around)) + LINE;
  print_second(field, prefix, text);
  flesh_picture_text(c, x, at, 0, 12, 0.15, words[field].first);
  flesh_picture_text(c, x, at += LINE, 0, 12, 0.15, text);
  at += LINE + 4;
  snprintf(text, sizeof text, "max %.4g", frame->most / unit + 0.0);
  if (isfinite(frame->most)) flesh_picture_text(c, x, at, 0, 11, 0.35, text);
  at += CAP + 4;
  draw_bar(c, x, at, length, field, frame, unit);
  at += length + CAP + LINE;
  snprintf(text, sizeof text, "min %.4g", frame->least / unit + 0.0);
  if (isfinite(frame->least)) flesh_picture_text(c, x, at, 0, 11, 0.35, text);
  if (!frame->inverted) return;
  at += LINE + 3;
  const float *black = flesh_render_inverted;
  cairo_set_source_rgb(c, flesh_srgb_encode(black[0]), flesh_srgb_encode(black[1]), flesh_srgb_encode(black[2]));
  cairo_rectangle(c, x, at - 10, BAR_WIDTH, 11);
  cairo_fill(c);
  flesh_picture_text(c, x + BAR_WIDTH + 6, at, 0, 11, 0.2, "inverted");
}
