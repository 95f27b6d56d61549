/* The image of docs/examples/c/m7 on this machine: what it prints on a board must be the same. */
#include "board.h"
#include <stdio.h>

void board_write(const char *text) { fputs(text, stdout); }

int main(void) { return image(); }
