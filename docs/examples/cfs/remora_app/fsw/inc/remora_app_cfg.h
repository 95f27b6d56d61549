/* What a platform may want to have otherwise. */
#ifndef REMORA_APP_CFG_H
#define REMORA_APP_CFG_H

#define REMORA_APP_PIPE_DEPTH 16

/* The task that plans: below everything with a period. A plan takes 31 KB of stack on x86-64; cFE's usual 16 KiB
 * are too few. */
#define REMORA_APP_PLANNER_PRIORITY 200
#define REMORA_APP_PLANNER_STACK (48 * 1024)

/* Room for a learned model's file. */
#define REMORA_APP_MODEL_BYTES (512 * 1024)

#define REMORA_APP_MISSION_FILE "/cf/remora_mission.tbl"
#define REMORA_APP_OPTIONS_FILE "/cf/remora_options.tbl"

/* A plan is written under the second name and renamed when it is whole. */
#define REMORA_APP_PLAN_FILE "/cf/remora.plan"
#define REMORA_APP_UNFINISHED_FILE "/cf/remora.tmp"

#endif
