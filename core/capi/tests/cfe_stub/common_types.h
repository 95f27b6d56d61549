/* Of the stub in cfe.h. */
#include "cfe.h"
