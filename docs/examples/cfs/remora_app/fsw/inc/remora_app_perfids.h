/* Performance log ids. */
#ifndef REMORA_APP_PERFIDS_H
#define REMORA_APP_PERFIDS_H

#define REMORA_APP_PERF_ID 92
#define REMORA_APP_PLANNER_PERF_ID 93

#endif
