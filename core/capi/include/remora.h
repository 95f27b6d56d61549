/* Remora: plans and flies the last minutes before a servicer catches a tumbling satellite.
 *
 * Made of the crate remora-capi by cbindgen; docs/c.md tells how it is used. All memory is the caller's. Every
 * function that answers a RemoraStatus leaves memory as it was where that is other than REMORA_STATUS_OK,
 * but for REMORA_STATUS_REFUSED and REMORA_STATUS_WRONG_CHECKSUM, which are results.
 */

#ifndef REMORA_H
#define REMORA_H

#include <stddef.h>
#include <stdint.h>
/* The first aligned address in memory that has REMORA_ALIGNMENT - 1 bytes more than are needed. */
#define REMORA_ALIGN(memory) \
    ((void *)(((uintptr_t)(memory) + (REMORA_ALIGNMENT - 1)) & ~(uintptr_t)(REMORA_ALIGNMENT - 1)))


// Number of this interface. It grows with every change of a structure, a function or a meaning.
#define REMORA_ABI 1

// Bytes of a workspace: planner, solver, network, the mission and the last plan.
#define REMORA_WORKSPACE_BYTES 1058816

// Bytes of a flight: guidance with the mission and the plan that it flies.
#define REMORA_FLIGHT_BYTES 20480

// Alignment of workspaces and flights in bytes; a power of two.
#define REMORA_ALIGNMENT 64

// Joints of the arm.
#define REMORA_JOINTS 3

// Most nodes of a plan.
#define REMORA_NODES 60

// RemoraOptions.mode: the optimum.
#define REMORA_OPTIMAL 0

// RemoraOptions.mode: the first plan that satisfies every constraint.
#define REMORA_FEASIBLE 1

// RemoraOptions.integrator: RK4, whose plans can be flown.
#define REMORA_RK4 0

// RemoraOptions.integrator: explicit Euler, the paper's, whose plans cannot.
#define REMORA_EULER 1

// Checksum of the plan that remora_self_test makes with Euler.
#define REMORA_SELF_TEST_EULER 1344585266407612226

// Checksum of the plan that remora_self_test makes with RK4.
#define REMORA_SELF_TEST_RK4 6767207187894076473

// remora_ask: another plan is wanted.
#define REMORA_REPLAN 1

// remora_ask: leave the target, from the next step on; there is no way back.
#define REMORA_ABORT 2

// What became of a call. Numbers never change their meaning.
enum RemoraStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done.
  REMORA_STATUS_OK = 0,
  // A pointer that must not be is NULL.
  REMORA_STATUS_NULL = 1,
  // The header that the caller was compiled with is of another interface than the archive.
  REMORA_STATUS_FOREIGN_ABI = 2,
  // Memory is shorter than the header says.
  REMORA_STATUS_SHORT_MEMORY = 3,
  // Memory or a structure is not aligned.
  REMORA_STATUS_MISALIGNED = 4,
  // The memory is no workspace: remora_open has not been called, or something wrote over it.
  REMORA_STATUS_NOT_OPEN = 5,
  // The memory is no flight: remora_fly has not been called, or something wrote over it.
  REMORA_STATUS_NO_FLIGHT = 6,
  // The workspace or flight is in use: the call came from one of its own callbacks.
  REMORA_STATUS_BUSY = 7,
  // A structure's first member is not its size.
  REMORA_STATUS_STRUCT_SIZE = 8,
  // A structure for results lies in the workspace or flight itself.
  REMORA_STATUS_OVERLAP = 9,
  // The processor makes zeros of small numbers; plans would have other bits.
  REMORA_STATUS_FLUSH_TO_ZERO = 10,
  // The processor does not round to nearest; plans would have other bits.
  REMORA_STATUS_ROUNDING = 11,
  // A number of the scenario or the estimate is not finite.
  REMORA_STATUS_NOT_FINITE = 12,
  // A number of the mission is out of its range.
  REMORA_STATUS_INVALID_MISSION = 13,
  // The scenario is none: an attitude that is no rotation, no distance, no time, too few nodes.
  REMORA_STATUS_INVALID_SCENARIO = 14,
  // An option is out of its range, or there is a deadline without a clock.
  REMORA_STATUS_INVALID_OPTION = 15,
  // A number of guidance's settings or of the limits is out of its range.
  REMORA_STATUS_INVALID_SETTING = 16,
  // A time is not finite, or negative where it must not be.
  REMORA_STATUS_INVALID_TIME = 17,
  // No plan can end well; RemoraReport.refusal says why. The workspace holds no plan now.
  REMORA_STATUS_REFUSED = 18,
  // The workspace holds no plan.
  REMORA_STATUS_NO_PLAN = 19,
  // The plan has no such node.
  REMORA_STATUS_NO_SUCH_NODE = 20,
  // The verifier did not find every constraint of the plan satisfied.
  REMORA_STATUS_NOT_FLYABLE = 21,
  // The plan was made with Euler's step and says nothing between its nodes.
  REMORA_STATUS_EULER_PLAN = 22,
  // The flight has no plan yet.
  REMORA_STATUS_NO_FLIGHT_PLAN = 23,
  // The flight's plan was made for another mission than the workspace's.
  REMORA_STATUS_OTHER_MISSION = 24,
  // Of the flight's plan nothing is left that could be planned again.
  REMORA_STATUS_NOTHING_LEFT = 25,
  // The self-test's plan has other bits than it must have.
  REMORA_STATUS_WRONG_CHECKSUM = 26,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraStatus RemoraStatus;
#else
typedef uint32_t RemoraStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Settings of guidance; remora_defaults fills in those that the flights of docs/flights.md were made with.
// What each means is told in docs/guidance.md. INFINITY is never.
typedef struct RemoraGuidance {
  // Size of this structure in bytes.
  uint32_t size;
  // Nothing; zero.
  uint32_t reserved;
  // Bandwidths: centre of mass, attitude, joints [rad/s].
  double bandwidth[3];
  // Largest product of a bandwidth and the time between steps [rad].
  double most_per_step;
  // Integral feedback, over the bandwidth's third power.
  double integral;
  // Largest error that an integral stands for [m], [rad].
  double integral_limit[2];
  // Times over which a new plan's command and the turn to the estimated target are faded in [s].
  double fade[2];
  // Bandwidth of the offset that the wrist camera measures [rad/s].
  double camera;
  // The last way: distances that are added, each taken back by itself [m].
  double closing_distances[2];
  // When they begin to come in and are there, before capture [s].
  double closing_out[2];
  // When each begins to go and is gone, before capture [s].
  double closing_back[2][2];
  // When the plan's own motion ends, before capture [s].
  double closing_settle;
  // When another plan is wanted: age of the plan in force [s].
  double replan_age;
  // Error of the centre of mass [m].
  double replan_position;
  // Error of the bus attitude [rad].
  double replan_attitude;
  // Error of the target's attitude from what the plan expects [rad].
  double replan_target;
  // Time before capture from which none is wanted any more [s].
  double replan_last;
  // When the approach is given up at first: position [m], attitude, joint [rad].
  double abort_settling[3];
  // Likewise afterwards.
  double abort_settled[3];
  // Time from the first step to then [s].
  double abort_settles;
  // Likewise near the target.
  double abort_near[3];
  // Time before capture from which these hold, and until which that of the position does [s].
  double abort_near_times[2];
  // Most that the end effector may be seen beside the port in the end; twice that is how far across the
  // port's normal it may be going to be off before [m].
  double abort_port;
} RemoraGuidance;

// What navigation knows at one instant. Numbers that are none are no misuse: guidance then answers what is
// planned and says so.
typedef struct RemoraEstimate {
  // Size of this structure in bytes.
  uint32_t size;
  // Whether `wrist` is given.
  uint32_t has_wrist;
  // Time on the clock that plans are dated by [s].
  double time;
  // Centre of mass of the bus relative to the target's, RTN [m].
  double position[3];
  // Its velocity relative to RTN, in RTN [m/s].
  double velocity[3];
  // Attitude of the bus, (x, y, z, w), body to RTN.
  double attitude[4];
  // Its angular velocity relative to RTN, in RTN [rad/s].
  double rate[3];
  // Joint angles [rad].
  double joint_angle[REMORA_JOINTS];
  // Joint rates [rad/s].
  double joint_rate[REMORA_JOINTS];
  // Attitude of the target.
  double target_attitude[4];
  // Its angular velocity relative to RTN, in RTN [rad/s].
  double target_rate[3];
  // End effector from the port, RTN axes [m], where a camera at the wrist sees it.
  double wrist[3];
} RemoraEstimate;

// What the actuators can do now.
typedef struct RemoraLimits {
  // Size of this structure in bytes.
  uint32_t size;
  // Nothing; zero.
  uint32_t reserved;
  // Largest force along each axis, RTN [N].
  double force[3];
  // Largest bus torque about each axis, bus axes [N m].
  double bus_torque[3];
  // Largest joint torques [N m].
  double joint_torque[REMORA_JOINTS];
} RemoraLimits;

// What the actuators are to do until the next step.
typedef struct RemoraCommand {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // 0 tracks, 1 tracks and wants another plan, 2 the estimate is no number, 3 leaves the target, 4 done.
  uint32_t mode;
  // Why another plan is wanted: 0 it is not, 1 time, 2 error, 3 tumble, 4 the caller asked.
  uint32_t wanted;
  // Nothing; zero.
  uint32_t reserved;
  // Force on the bus at its centre of mass, RTN [N].
  double force[3];
  // Torque on the bus, bus axes [N m].
  double bus_torque[3];
  // Joint torques; the feed-forward of joints that follow the references below [N m].
  double joint_torque[REMORA_JOINTS];
  // Angles for joints with servos of their own [rad].
  double joint_angle[REMORA_JOINTS];
  // Their rates [rad/s].
  double joint_rate[REMORA_JOINTS];
  // Errors from what is asked for: centre of mass [m], attitude, the joint farthest off, target [rad].
  double error[4];
  // Shares of the feedback that the limits leave: of the force, of the torques.
  double share[2];
} RemoraCommand;

// One link of the arm, in axes that are parallel to the bus's while all joints are at zero.
typedef struct RemoraLink {
  // From its joint to the next one, for the last link to the end effector [m].
  double tip[3];
  // Centre of mass from its joint [m].
  double center_of_mass[3];
  // Mass [kg].
  double mass;
  // Inertia about the centre of mass [kg m^2]; symmetric.
  double inertia[3][3];
  // Unit joint axis.
  double axis[3];
  // Inertia of the joint's rotor, times the gear ratio squared [kg m^2].
  double armature;
  // Radius of the capsule that holds the link [m].
  double radius;
} RemoraLink;

// Everything that is the same for every approach: orbit, target, servicer, limits, tolerances. What each
// number means is told in docs/problem.md; remora_defaults fills in the mission of that page.
typedef struct RemoraMission {
  // Size of this structure in bytes.
  uint32_t size;
  // Whether the gravity gradient turns the target: 0 with RK4 only, 1 yes, 2 no.
  uint32_t gravity_gradient;
  // Earth's gravitational parameter [m^3/s^2].
  double gravitational_parameter;
  // Semi-major axis of the target's orbit [m].
  double semi_major_axis;
  // Its eccentricity.
  double eccentricity;
  // Its inclination [rad].
  double inclination;
  // Half edge lengths of the target's box [m].
  double target_half_extents[3];
  // Principal moments of inertia of the target [kg m^2].
  double target_inertia[3];
  // Mass of the target [kg].
  double target_mass;
  // Docking port, target axes [m].
  double port_position[3];
  // Its outward unit normal.
  double port_normal[3];
  // Mass of the bus [kg].
  double bus_mass;
  // Inertia of the bus about its centre of mass [kg m^2]; symmetric.
  double bus_inertia[3][3];
  // Half edge lengths of the box about the bus's centre of mass [m].
  double bus_half_extents[3];
  // Unit boresight of the camera, bus axes.
  double boresight[3];
  // First joint from the bus's centre of mass, bus axes [m].
  double arm_base[3];
  // The arm, from the bus outwards.
  struct RemoraLink links[REMORA_JOINTS];
  // Lower stops [rad].
  double min_joint_angle[REMORA_JOINTS];
  // Upper stops [rad].
  double max_joint_angle[REMORA_JOINTS];
  // Limits of the joint rates [rad/s].
  double max_joint_rate[REMORA_JOINTS];
  // Joint angles at the start, unless a scenario gives others [rad].
  double initial_joint_angle[REMORA_JOINTS];
  // Joint angles at capture [rad].
  double capture_joint_angle[REMORA_JOINTS];
  // Largest force along each axis, RTN [N].
  double max_force[3];
  // Largest bus torque about each axis, bus axes [N m].
  double max_bus_torque[3];
  // Largest joint torques [N m].
  double max_joint_torque[REMORA_JOINTS];
  // Time from the first node to the last [s].
  double duration;
  // Nodes of a plan, at most REMORA_NODES.
  uint32_t nodes;
  // Whether bodies must stay clear of each other: 0 with RK4 only, 1 yes, 2 no.
  uint32_t clearance;
  // Whether limits hold between nodes too: 0 with RK4 only, 1 yes, 2 no.
  uint32_t between_nodes;
  // Whether `typical` is given; otherwise it follows from the rest.
  uint32_t has_typical;
  // Keep-out distance of the system's centre of mass from the target's box while far [m].
  double keep_out_far;
  // The same later [m].
  double keep_out_near;
  // Time before the end from which the near distance holds [s].
  double keep_out_near_time;
  // Half angle of the camera's cone [rad].
  double field_of_view_half_angle;
  // Time before the end from which the arm has its capture angles [s].
  double preset_time;
  // Time within which a start beyond a limit is led back [s].
  double recovery_time;
  // Weights of the cost: force, change of force, bus torque, joint torque.
  double weights[4];
  // Tolerances in the order of RemoraVerification's residuals from `dynamics`: of the dynamics of both
  // stages, control, joint, joint rate, pointing, preset, terminal rate, keep-out, end effector's
  // position, its angle, clearance.
  double tolerances[11];
  // Margins: joint angle, joint rate, keep-out, field of view, clearance.
  double margins[5];
  // The end effector's corridor: half angle [rad], radius at the port [m], length of the end effector [m].
  double corridor[3];
  // What steps are divided by: length, velocity, force, angle, rate, joint rate, bus torque, joint torque.
  double typical[8];
  // Whether the roll at capture is given by the two directions below.
  uint32_t has_roll;
  // Nothing; zero.
  uint32_t reserved;
  // Unit vector in the last link's axes ...
  double roll_end_effector[3];
  // ... which is along this one of the target at capture.
  double roll_port[3];
} RemoraMission;

// One approach: the target's tumble, where the servicer starts, and how long it has. RTN is radial, along
// track, orbit normal; quaternions are (x, y, z, w), body to RTN.
typedef struct RemoraScenario {
  // Size of this structure in bytes.
  uint32_t size;
  // Nodes of the plan; 0: the mission's.
  uint32_t nodes;
  // Attitude of the target at t = 0.
  double target_attitude[4];
  // Its angular velocity relative to RTN, in target axes [rad/s].
  double target_rate[3];
  // Centre of mass of bus and arm at t = 0, RTN [m].
  double position[3];
  // Its velocity relative to RTN, in RTN [m/s].
  double velocity[3];
  // Time from t = 0 to capture [s]; 0: the mission's.
  double duration;
  // Whether `bus_attitude` is given; otherwise the bus looks at the target.
  uint32_t has_bus_attitude;
  // Whether `joint_angle` is given; otherwise the arm has the mission's initial angles.
  uint32_t has_joint_angle;
  // Attitude of the bus at t = 0.
  double bus_attitude[4];
  // Its angular velocity relative to RTN, in RTN [rad/s].
  double bus_rate[3];
  // Joint angles at t = 0 [rad].
  double joint_angle[REMORA_JOINTS];
  // Joint rates at t = 0 [rad/s].
  double joint_rate[REMORA_JOINTS];
} RemoraScenario;

// How to plan. remora_defaults fills in: the optimum, RK4 with eight substeps, the heuristic guess, no
// deadline.
typedef struct RemoraOptions {
  // Size of this structure in bytes.
  uint32_t size;
  // REMORA_OPTIMAL or REMORA_FEASIBLE.
  uint32_t mode;
  // REMORA_RK4 or REMORA_EULER.
  uint32_t integrator;
  // Substeps of RK4 in an interval, from 4 to 1000; of no meaning with Euler.
  uint32_t substeps;
  // Time for the whole plan with its verification [s]; INFINITY for none. Needs a clock.
  double deadline;
  // A learned model's file for the initial guess, at any alignment, or NULL: then, or where the file is
  // damaged or for other plans, the heuristic serves. Read during the call only.
  const uint8_t *model;
  // Bytes of the file.
  size_t model_bytes;
  // Seed of a model that samples.
  uint64_t seed;
  // Reads a monotonic clock [s], or NULL.
  double (*clock)(void *context);
  // Is called some thousand times a plan, or NULL: the place for a step of guidance on one core. Where
  // it answers other than zero, planning ends; what is left is not flyable.
  uint32_t (*should_stop)(void *context);
  // Handed to both.
  void *context;
} RemoraOptions;

// What became of a plan.
typedef struct RemoraReport {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // Whether the verifier found every constraint satisfied: the plan can be flown.
  uint32_t is_verified;
  // 0 optimal, 1 verified but not converged, 2 not flyable.
  uint32_t verdict;
  // 0 solved, 1 iteration limit, 2 infeasible, 3 deadline, 4 numerical failure.
  uint32_t status;
  // Initial guess of Stage 2: 0 heuristic, 1 model, 8 the plan in force; other numbers: the heuristic, as
  // the other guess was 2 refused, 3 not finite, 4 worse, 5 without success, 6 too late, 9 unfit.
  uint32_t start;
  // Why the scenario was refused; 0: it was not.
  uint32_t refusal;
  // Name of the constraint it was refused for; empty if it was not.
  char refusal_name[16];
  // Nodes of the plan.
  uint32_t nodes;
  // Iterations of Stage 1.
  uint32_t iterations_1;
  // Iterations of Stage 2.
  uint32_t iterations_2;
  // Nothing; zero.
  uint32_t reserved;
  // Time from the first node to the last [s].
  double duration;
  // When a plan of remora_replan begins, on the clock of the estimates [s]; 0 for others.
  double begins;
  // Cost of the path of the centre of mass.
  double cost_1;
  // Cost of attitude and arm.
  double cost_2;
  // Time that planning took by the caller's clock [s]; 0 without one.
  double seconds;
  // Checksum of the plan's exact bits: the same for the same input behind every door of Remora.
  uint64_t checksum;
} RemoraReport;

// A plan at one of its nodes. Controls hold from there to the next node; at the last they are zero.
typedef struct RemoraNode {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // The node, from 0.
  uint32_t index;
  // Time since the first node [s].
  double time;
  // Centre of mass of bus and arm, RTN [m].
  double position[3];
  // Its velocity relative to RTN, in RTN [m/s].
  double velocity[3];
  // Attitude of the bus, (x, y, z, w), body to RTN.
  double attitude[4];
  // Its angular velocity relative to RTN, in RTN [rad/s].
  double rate[3];
  // Joint angles [rad].
  double joint_angle[REMORA_JOINTS];
  // Joint rates [rad/s].
  double joint_rate[REMORA_JOINTS];
  // Force, RTN [N].
  double force[3];
  // Torque on the bus, bus axes [N m].
  double bus_torque[3];
  // Joint torques [N m].
  double joint_torque[REMORA_JOINTS];
} RemoraNode;

// How near two bodies come to each other.
typedef struct RemoraClosest {
  // Distance of their surfaces [m]; negative where they overlap, infinite where nobody has looked.
  double distance;
  // When [s].
  double time;
  // 0 the bus, then the links, from 1.
  uint32_t body;
  // Nothing; zero.
  uint32_t reserved;
} RemoraClosest;

// What the independent verifier finds: residuals, zero where a constraint is satisfied, and distances.
typedef struct RemoraVerification {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // Whether every residual is within the mission's tolerance.
  uint32_t is_verified;
  // Dynamics of Stage 1, over 1 m and 1e-2 m/s.
  double dynamics1;
  // Dynamics of Stage 2, over 1, 1 rad and 1e-2 rad/s.
  double dynamics2;
  // Controls beyond their limits, over these.
  double control;
  // Joints beyond their stops [rad].
  double joint;
  // Joint rates beyond their limits, over these.
  double joint_rate;
  // Port out of view, in cosine.
  double pointing;
  // Arm off its capture angles, over 1 rad and 1e-2 rad/s.
  double preset;
  // Rate of the bus relative to the target at capture, over 1e-2 rad/s.
  double terminal_rate;
  // Within the keep-out distance [m].
  double keep_out;
  // End effector off the port [m].
  double ee_position;
  // End effector off the direction of approach [rad].
  double ee_angle;
  // Overlap of bodies [m].
  double clearance;
  // Arm and target.
  struct RemoraClosest arm;
  // Bus and target.
  struct RemoraClosest bus;
  // Arm and its own bus.
  struct RemoraClosest own;
} RemoraVerification;

// A stage in the record.
typedef struct RemoraStage {
  // As RemoraReport.status.
  uint32_t status;
  // Iterations.
  uint32_t iterations;
  // Second-order corrections.
  uint32_t corrections;
  // Iterations of the solver of all its subproblems.
  uint32_t qp_iterations;
  // Subproblems not solved to full accuracy.
  uint32_t qp_unsolved;
  // What was left in place of the last iterate: 0 nothing, 1 an earlier one, 2 the initial guess.
  uint32_t fallback;
} RemoraStage;

// The record to file with a plan. The same input leaves the same one on every machine: no time is in it.
typedef struct RemoraRecord {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // As RemoraReport.status.
  uint32_t status;
  // Whether the verifier found every residual within its tolerance.
  uint32_t is_verified;
  // As RemoraReport.start.
  uint32_t start;
  // Limits that the start violates and the plan leads back into, a bit each.
  uint32_t recovery;
  // Nothing; zero.
  uint32_t reserved;
  // Checksum of mission and scenario.
  uint64_t input;
  // Checksum of options, horizon and solver.
  uint64_t settings;
  // Checksum of the plan.
  uint64_t output;
  // Stage 1.
  struct RemoraStage translation;
  // Stage 2.
  struct RemoraStage reorientation;
  // Version of the planner, ended by zero.
  char version[16];
} RemoraRecord;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The number of the archive's interface; to be compared with REMORA_ABI.
uint32_t remora_abi(void);

// Says in English what a status means. Never NULL, and never to be freed.
const char *remora_strerror(uint32_t status);

// Makes a flight of memory: at least REMORA_FLIGHT_BYTES, at a multiple of REMORA_ALIGNMENT. It stays the
// caller's. A flight is plain data, which may be copied byte by byte while nobody works in it. `settings` may
// be NULL: the defaults.
//
// # Safety
// `memory` is NULL or `bytes` long; `settings` is NULL or as long as its first member says.
RemoraStatus remora_fly(void *memory, size_t bytes, uint32_t abi, const struct RemoraGuidance *settings);

// Hands the plan in the workspace to a flight, its first node at time `begins` on the clock of the estimates
// [s]. A flight that has a plan goes over to this one: the command does not jump. Plans of one flight begin
// at different times.
//
// # Safety
// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, `flight` NULL or REMORA_FLIGHT_BYTES.
RemoraStatus remora_flight_plan(const void *workspace, double begins, void *flight);

// One step of guidance, at any rate from 0.2 to 20 Hz: what the actuators are to do from the estimate's time
// to the next step's. `limits` may be NULL: those of the servicer.
//
// # Safety
// `flight` is NULL or REMORA_FLIGHT_BYTES long, structures are NULL or as long as their first members say.
RemoraStatus remora_guide(void *flight,
                          const struct RemoraEstimate *estimate,
                          const struct RemoraLimits *limits,
                          struct RemoraCommand *command);

// What navigation would know at a time, were the servicer and the target exactly where the flight's plan
// expects them: for tests of what surrounds guidance.
//
// # Safety
// As remora_guide.
RemoraStatus remora_expected(const void *flight, double time, struct RemoraEstimate *estimate);

// Asks a flight for something: REMORA_REPLAN or REMORA_ABORT.
//
// # Safety
// `flight` is NULL or REMORA_FLIGHT_BYTES long.
RemoraStatus remora_ask(void *flight, uint32_t what);

// Fills in what most callers begin with, sizes included; each pointer may be NULL. What a caller does not set
// afterwards keeps what stands here.
//
// # Safety
// Each pointer is NULL or leads to room for its structure.
RemoraStatus remora_defaults(uint32_t abi,
                             struct RemoraMission *mission,
                             struct RemoraScenario *scenario,
                             struct RemoraOptions *options,
                             struct RemoraGuidance *guidance);

// Makes a workspace of memory: at least REMORA_WORKSPACE_BYTES, at a multiple of REMORA_ALIGNMENT. It stays
// the caller's, is never freed, and may be opened again for another mission. One thread uses it at a time.
// Where a plan was cut off by a reset, fill the first 64 bytes with zero before.
//
// # Safety
// `memory` is NULL or `bytes` long; `mission` is NULL or as long as its first member says.
RemoraStatus remora_open(void *memory, size_t bytes, uint32_t abi, const struct RemoraMission *mission);

// Plans one approach. Where the scenario is refused, the report says why and the workspace holds no plan;
// where anything else is wrong, nothing is changed. REMORA_STATUS_OK says that there is a plan; whether it
// can be flown is RemoraReport.is_verified.
//
// # Safety
// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, structures are NULL or as long as their first members
// say, the model's file is as long as is said, callbacks can be called.
RemoraStatus remora_plan(void *workspace,
                         const struct RemoraScenario *scenario,
                         const struct RemoraOptions *options,
                         struct RemoraReport *report);

// Plans again what is left of a flight's plan, to take over `lead` seconds after the estimate, with that plan
// as the guess; a model is not asked. The flight is read before planning begins and stays as it is: it takes
// the new plan by remora_flight_plan(workspace, report.begins, flight). A flight that another thread guides
// meanwhile is given as a copy.
//
// # Safety
// As remora_plan; `flight` is NULL or REMORA_FLIGHT_BYTES long.
RemoraStatus remora_replan(void *workspace,
                           const void *flight,
                           const struct RemoraEstimate *estimate,
                           double lead,
                           const struct RemoraOptions *options,
                           struct RemoraReport *report);

// Copies a node of the plan out, from 0 to RemoraReport.nodes - 1.
//
// # Safety
// As remora_plan.
RemoraStatus remora_node(const void *workspace, uint32_t index, struct RemoraNode *node);

// Runs the independent verifier again on the plan in the workspace.
//
// # Safety
// As remora_plan.
RemoraStatus remora_verify(const void *workspace, struct RemoraVerification *verification);

// Copies the record of the plan in the workspace out: what is to be filed with it.
//
// # Safety
// As remora_plan.
RemoraStatus remora_record(const void *workspace, struct RemoraRecord *record);

// Plans a built-in scenario of the built-in mission and tells the plan's checksum, which must be
// REMORA_SELF_TEST_RK4 or REMORA_SELF_TEST_EULER: otherwise compiler, processor or memory are not what they
// were tested to be. The workspace holds no plan afterwards.
//
// # Safety
// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, `checksum` is NULL or leads to a number.
RemoraStatus remora_self_test(void *workspace, uint32_t integrator, uint64_t *checksum);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* REMORA_H */
