/* png_file.h: whether a picture that another program has written is whole. */
#ifndef FLESH_PICTURE_PNG_FILE_H
#define FLESH_PICTURE_PNG_FILE_H

/* Whether the file begins as a PNG does and ends with its last chunk. */
int flesh_png_is_whole(const char *path);
/* Like flesh_png_is_whole, for a picture that is named .svg, .pdf or .png. */
int flesh_picture_is_whole(const char *path);

#endif
