/* vtk.h: what the reader of VTK's XML files has of them: tags with attributes, and arrays of numbers. */
#ifndef FLESH_MESH_VTK_H
#define FLESH_MESH_VTK_H

#include "base/scan.h"

/* <name attributes> or </name>. */
typedef struct flesh_xml_tag {
  const char *name, *end; /* end: behind the name and the attributes */
  size_t length;          /* of the name */
  int closes;             /* </name> */
  int64_t line;
} flesh_xml_tag;

/* The next tag, over text, comments and declarations; 0 at the end of the file. The scanner stands behind it. */
int flesh_xml_next(flesh_scanner *s, flesh_xml_tag *tag);
int flesh_xml_is(const flesh_xml_tag *tag, const char *name);
/* Whether the tag has the attribute; its value in *value [*length]. */
int flesh_xml_attribute(const flesh_xml_tag *tag, const char *name, const char **value, size_t *length);
int flesh_xml_attribute_is(const flesh_xml_tag *tag, const char *name, const char *value);

/* How the file has its numbers. */
typedef struct flesh_vtk_file {
  flesh_scanner *s;
  int swap;             /* not this machine's byte order */
  int header_size;      /* bytes of a number before an array's bytes, 4 or 8 */
  int compressed;       /* by zlib */
  const char *appended; /* first byte of the appended data; NULL: there are none */
  int appended_base64;
} flesh_vtk_file;

typedef enum flesh_vtk_format { FLESH_VTK_ASCII, FLESH_VTK_BINARY, FLESH_VTK_APPENDED } flesh_vtk_format;

typedef struct flesh_vtk_array {
  const char *name; /* for messages; NULL: the file has no such array */
  int size;         /* bytes of a number */
  char kind;        /* 'f', 'i' or 'u': real, integer, unsigned */
  int components;
  flesh_vtk_format format;
  int64_t offset;   /* in the appended data */
  const char *text; /* what follows the tag */
  int64_t line;     /* of the tag */
} flesh_vtk_array;

/* A whole number in an attribute; `missing` where there is no such attribute, -1 where it is none. */
int64_t flesh_xml_number(const flesh_xml_tag *tag, const char *attribute, int64_t missing);

/* The array whose tag was read last, called `name`. FLESH_ERR_FILE for a type or a format that there is not. */
int flesh_vtk_array_read(const flesh_vtk_file *file, const flesh_xml_tag *tag, const char *name, flesh_vtk_array *array);
/* Its numbers, of which there must be `count`, all as reals or all as integers. Returns new, to be freed. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY. */
int flesh_vtk_reals(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, double **numbers);
int flesh_vtk_integers(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, int64_t **numbers);

/* Fails with the array's line before the sentence. */
int flesh_vtk_fail(const flesh_vtk_file *file, int64_t line, const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif
