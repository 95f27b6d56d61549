/* Tables. Each begins with a checksum of what follows it: CFE_ES_CalculateCRC, CRC-16/ARC, of the bytes as they
 * lie in the processor's memory. A table with another one is refused, and the event says which it should be. */
#ifndef REMORA_APP_TBL_H
#define REMORA_APP_TBL_H

#include "common_types.h"

#include <remora.h>

/* Orbit, target, servicer, limits. */
typedef struct {
    uint32 Crc;
    uint32 Spare;
    RemoraMission Mission;
} REMORA_APP_MissionTable_t;

/* How to plan, from which model, and how to fly. */
typedef struct {
    uint32 Crc;
    uint32 Mode;       /* RemoraMode */
    uint32 Integrator; /* RemoraIntegrator */
    uint32 Substeps;   /* of RK4 in an interval */
    double Deadline;   /* of a plan [s]; 0 for none */
    char ModelFile[64]; /* empty: the heuristic makes the initial guess */
    uint32 ModelCrc;   /* of the file, as above */
    uint32 Spare;
    RemoraGuidance Guidance;
} REMORA_APP_OptionsTable_t;

#endif
