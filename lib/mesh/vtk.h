/* vtk.h: VTK's XML files as their reader needs them: tags with attributes, and arrays of numbers. */
#ifndef FLESH_MESH_VTK_H
#define FLESH_MESH_VTK_H

#include "base/scan.h"

/* A tag <name attributes> or </name>. */
typedef struct flesh_xml_tag {
  const char *name, *end; /* end: after the name and the attributes */
  size_t length;          /* of the name */
  int closes;             /* 1: the tag is </name> */
  int64_t line;
} flesh_xml_tag;

/* Reads the next tag, over text, comments and declarations; returns 0 at the end of the file. The scanner is then after
 * the tag. */
int flesh_xml_next(flesh_scanner *s, flesh_xml_tag *tag);
int flesh_xml_is(const flesh_xml_tag *tag, const char *name);
/* Returns whether the tag has the attribute, and its value in *value [*length]. */
int flesh_xml_attribute(const flesh_xml_tag *tag, const char *name, const char **value, size_t *length);
int flesh_xml_attribute_is(const flesh_xml_tag *tag, const char *name, const char *value);

/* How the file stores its numbers. */
typedef struct flesh_vtk_file {
  flesh_scanner *s;
  int swap;             /* 1: the byte order is not this machine's */
  int header_size;      /* bytes of the length before an array's data, 4 or 8 */
  int compressed;       /* 1: compressed by zlib */
  const char *appended; /* first byte of the appended data; NULL: none */
  int appended_base64;
} flesh_vtk_file;

typedef enum flesh_vtk_format { FLESH_VTK_ASCII, FLESH_VTK_BINARY, FLESH_VTK_APPENDED } flesh_vtk_format;

typedef struct flesh_vtk_array {
  const char *name; /* for messages; NULL: the file has no such array */
  int size;         /* bytes of a number */
  char kind;        /* 'f', 'i' or 'u': real, integer, unsigned */
  int components;
  flesh_vtk_format format;
  int64_t offset;   /* place in the appended data */
  const char *text; /* text after the tag */
  int64_t line;     /* line of the tag */
} flesh_vtk_array;

/* Returns a whole number in an attribute; `missing` if there is no such attribute, -1 if it is not a whole number. */
int64_t flesh_xml_number(const flesh_xml_tag *tag, const char *attribute, int64_t missing);

/* Describes the array of the tag that was read last; `name` is for messages. FLESH_ERR_FILE for an unknown type or
 * format. */
int flesh_vtk_array_read(const flesh_vtk_file *file, const flesh_xml_tag *tag, const char *name, flesh_vtk_array *array);
/* Read the `count` numbers of an array as reals or as integers. Returns new, to be freed. FLESH_ERR_FILE if their
 * number is another, FLESH_ERR_MEMORY. */
int flesh_vtk_reals(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, double **numbers);
int flesh_vtk_integers(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, int64_t **numbers);

/* Fails with the array's line before the sentence. */
int flesh_vtk_fail(const flesh_vtk_file *file, int64_t line, const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif
