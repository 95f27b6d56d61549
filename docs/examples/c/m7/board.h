/* What image.c needs of a board, and what a board needs of image.c. */
#ifndef BOARD_H
#define BOARD_H

/* The board's: sends a text. */
void board_write(const char *text);

/* Called by the board once memory is initialised: whether all went well, 0 if so. */
int image(void);

#endif
