/* Remora: plans and flies the last minutes before a servicer catches a tumbling satellite.
 *
 * Made of the crate remora-capi by cbindgen; docs/guides/c.md tells how it is used. All memory is the caller's. Every
 * function that answers a RemoraStatus leaves memory as it was where that is other than REMORA_STATUS_OK,
 * but for REMORA_STATUS_REFUSED and REMORA_STATUS_WRONG_CHECKSUM, which are results, and for
 * REMORA_STATUS_STEP_TIME. Codes are of the enumeration whose name their type has, 32 bits long.
 *
 * Names end with axes and unit: _rtn radial, along track, orbit normal, at the target; _body the axes of the body
 * that the name begins with; _bus, _target and _link those of another. _body_to_rtn is a quaternion (x, y, z, w).
 * Positions are from the target's centre of mass: com_ of the centre of mass of bus and arm together, bus_ of the
 * bus alone, ee_ of the end effector. A number whose size is above 1e30 is refused wherever it stands.
 */

#ifndef REMORA_H
#define REMORA_H

#include <stddef.h>
#include <stdint.h>
/* The first aligned address in memory that has REMORA_ALIGNMENT - 1 bytes more than are needed. */
#define REMORA_ALIGN(memory) \
    ((void *)(((uintptr_t)(memory) + (REMORA_ALIGNMENT - 1)) & ~(uintptr_t)(REMORA_ALIGNMENT - 1)))


// Number of this interface. It grows with every change of a structure, a function or a meaning.
#define REMORA_ABI 3

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

// Checksum of the plan that remora_self_test makes with Euler.
#define REMORA_SELF_TEST_EULER 1344585266407612226

// Checksum of the plan that remora_self_test makes with RK4.
#define REMORA_SELF_TEST_RK4 6767207187894076473

// Result of a call. Numbers never change their meaning.
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
  // A time is not finite, beyond 1e12 s, or negative where it must not be.
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
  // Nothing of the flight's plan is left that could be planned again.
  REMORA_STATUS_NOTHING_LEFT = 25,
  // The self-test's plan has other bits than it must have.
  REMORA_STATUS_WRONG_CHECKSUM = 26,
  // The step of guidance is not 0.05 to 5 s after the one before.
  REMORA_STATUS_STEP_TIME = 27,
  // An attitude of the estimate is not of unit length, or a flag is neither 0 nor 1.
  REMORA_STATUS_INVALID_ESTIMATE = 28,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraStatus RemoraStatus;
#else
typedef uint32_t RemoraStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Goal at which planning ends.
enum RemoraMode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Ends at the optimum.
  REMORA_MODE_OPTIMAL = 0,
  // Ends at the first plan that satisfies every constraint.
  REMORA_MODE_FEASIBLE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraMode RemoraMode;
#else
typedef uint32_t RemoraMode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Integrator of a plan.
enum RemoraIntegrator
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // RK4: its plans can be flown.
  REMORA_INTEGRATOR_RK4 = 0,
  // Explicit Euler, the paper's: its plans cannot be flown.
  REMORA_INTEGRATOR_EULER = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraIntegrator RemoraIntegrator;
#else
typedef uint32_t RemoraIntegrator;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Whether a part of the problem is in force.
enum RemoraSwitch
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // In force with RK4 only.
  REMORA_SWITCH_AUTO = 0,
  // In force.
  REMORA_SWITCH_ON = 1,
  // Not in force.
  REMORA_SWITCH_OFF = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraSwitch RemoraSwitch;
#else
typedef uint32_t RemoraSwitch;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Verdict on a plan.
enum RemoraVerdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Verified and converged; in feasibility mode verified and feasible.
  REMORA_VERDICT_OPTIMAL = 0,
  // Verified but not converged: it can be flown, perhaps at a higher cost.
  REMORA_VERDICT_VERIFIED = 1,
  // The verifier found a violation: it cannot be flown.
  REMORA_VERDICT_NOT_FLYABLE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraVerdict RemoraVerdict;
#else
typedef uint32_t RemoraVerdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// End of a solver's run.
enum RemoraSolveStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Feasible, and converged unless the first feasible iterate was asked for.
  REMORA_SOLVE_STATUS_SOLVED = 0,
  // The iteration limit was reached, or steps became too small.
  REMORA_SOLVE_STATUS_ITERATION_LIMIT = 1,
  // Constraints cannot be satisfied, or the verifier found a violation.
  REMORA_SOLVE_STATUS_INFEASIBLE = 2,
  // The deadline passed first, or the caller stopped planning.
  REMORA_SOLVE_STATUS_DEADLINE = 3,
  // Arithmetic broke down.
  REMORA_SOLVE_STATUS_NUMERICAL_FAILURE = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraSolveStatus RemoraSolveStatus;
#else
typedef uint32_t RemoraSolveStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Initial guess of Stage 2, and why the heuristic took the place of another.
enum RemoraStart
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The heuristic, as asked.
  REMORA_START_HEURISTIC = 0,
  // The model's.
  REMORA_START_MODEL = 1,
  // The heuristic: the model's file is damaged.
  REMORA_START_REFUSED = 2,
  // The heuristic: the other guess was not finite.
  REMORA_START_NOT_FINITE = 3,
  // The heuristic: the other guess was worse.
  REMORA_START_WORSE = 4,
  // The heuristic: the solver did not converge from the other guess.
  REMORA_START_UNSOLVED = 5,
  // The heuristic: the deadline had passed.
  REMORA_START_DEADLINE = 6,
  // The user's; not from C.
  REMORA_START_USER = 7,
  // The rest of the plan in force.
  REMORA_START_NOMINAL = 8,
  // The heuristic: the model is for other plans.
  REMORA_START_UNFIT = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraStart RemoraStart;
#else
typedef uint32_t RemoraStart;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Iterate that a stage left in place of its last one.
enum RemoraFallback
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // None: the last one stands.
  REMORA_FALLBACK_NONE = 0,
  // An earlier one.
  REMORA_FALLBACK_EARLIER_ITERATE = 1,
  // The initial guess.
  REMORA_FALLBACK_START = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraFallback RemoraFallback;
#else
typedef uint32_t RemoraFallback;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Constraint for which a scenario was refused.
enum RemoraRefusal
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // None: the scenario was not refused.
  REMORA_REFUSAL_NONE = 0,
  // A number is not finite.
  REMORA_REFUSAL_NOT_FINITE = 1,
  // The target's attitude is not a rotation.
  REMORA_REFUSAL_ATTITUDE = 2,
  // The servicer starts at the target's centre.
  REMORA_REFUSAL_POSITION = 3,
  // Nodes are too far apart for the orbit.
  REMORA_REFUSAL_NODE_INTERVAL = 4,
  // The preset time is too long for the approach.
  REMORA_REFUSAL_PRESET_LEAD = 5,
  // A joint is too slow for its way to the capture angles.
  REMORA_REFUSAL_JOINT_RATE = 6,
  // The port is outside the field of view at capture.
  REMORA_REFUSAL_CAPTURE_VIEW = 7,
  // The bus is inside the target at capture.
  REMORA_REFUSAL_CLEARANCE = 8,
  // The servicer starts within the keep-out distance.
  REMORA_REFUSAL_KEEP_OUT = 9,
  // The port is outside the field of view at the start.
  REMORA_REFUSAL_FIELD_OF_VIEW = 10,
  // The target turns too far from node to node.
  REMORA_REFUSAL_TUMBLE = 11,
  // The end effector does not reach as far as the keep-out distance.
  REMORA_REFUSAL_REACH = 12,
  // The thrusters are too weak.
  REMORA_REFUSAL_FORCE = 13,
  // The bus cannot be turned as fast as the target.
  REMORA_REFUSAL_BUS_TORQUE = 14,
  // The time to capture is not above zero.
  REMORA_REFUSAL_DURATION = 15,
  // A joint starts too far beyond its stop.
  REMORA_REFUSAL_JOINT_STOP = 16,
  // Too few nodes, or too many.
  REMORA_REFUSAL_NODES = 17,
  // The arm is inside its own bus at capture.
  REMORA_REFUSAL_OWN_BUS = 18,
  // Memory changed during planning.
  REMORA_REFUSAL_DAMAGED = 19,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraRefusal RemoraRefusal;
#else
typedef uint32_t RemoraRefusal;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// State of guidance.
enum RemoraFlightMode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Tracks the plan.
  REMORA_FLIGHT_MODE_TRACK = 0,
  // Tracks the plan and wants another one.
  REMORA_FLIGHT_MODE_REPLAN_WANTED = 1,
  // The estimate has NaN or infinity: the planned command goes out without feedback.
  REMORA_FLIGHT_MODE_DEGRADED = 2,
  // Leaves the target.
  REMORA_FLIGHT_MODE_ABORT = 3,
  // The plan's time is over.
  REMORA_FLIGHT_MODE_DONE = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraFlightMode RemoraFlightMode;
#else
typedef uint32_t RemoraFlightMode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Reason why another plan is wanted.
enum RemoraReason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // None: no other plan is wanted.
  REMORA_REASON_NONE = 0,
  // The plan is as old as it may be.
  REMORA_REASON_TIME = 1,
  // The servicer is too far from the plan.
  REMORA_REASON_ERROR = 2,
  // The target's attitude is too far from the plan's prediction.
  REMORA_REASON_TUMBLE = 3,
  // The caller asked for it.
  REMORA_REASON_CALLER = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraReason RemoraReason;
#else
typedef uint32_t RemoraReason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Request of remora_ask.
enum RemoraRequest
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Another plan is wanted.
  REMORA_REQUEST_REPLAN = 1,
  // Leave the target, from the next step on; there is no way back.
  REMORA_REQUEST_ABORT = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraRequest RemoraRequest;
#else
typedef uint32_t RemoraRequest;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Limits that a start violates and its plan leads back into: a bit each of RemoraRecord.recovery.
enum RemoraRecovery
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Stop of a joint.
  REMORA_RECOVERY_JOINT = 1,
  // Rate of a joint.
  REMORA_RECOVERY_JOINT_RATE = 2,
  // Field of view.
  REMORA_RECOVERY_POINTING = 4,
  // Keep-out distance.
  REMORA_RECOVERY_KEEP_OUT = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum RemoraRecovery RemoraRecovery;
#else
typedef uint32_t RemoraRecovery;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Settings of guidance; remora_defaults fills in those that the flights of docs/guides/simulate.md were made with.
// docs/concepts/guidance.md explains each setting. Numbers are finite. Bandwidths and fade times are above zero.
// Replan and abort errors are above zero too, and INFINITY turns one off. Others are at least zero.
typedef struct RemoraGuidance {
  // Size of this structure in bytes.
  uint32_t size;
  // Not read.
  uint32_t reserved;
  // Bandwidth of the centre of mass [rad/s].
  double com_bandwidth_rad_s;
  // Bandwidth of the bus attitude [rad/s].
  double bus_bandwidth_rad_s;
  // Bandwidth of the joints [rad/s].
  double joint_bandwidth_rad_s;
  // Largest product of a bandwidth and the time between steps [rad].
  double most_per_step_rad;
  // Integral feedback, over the bandwidth's third power.
  double integral;
  // Largest error of the centre of mass that an integral stands for [m].
  double integral_limit_com_m;
  // Largest error of an angle that an integral stands for [rad].
  double integral_limit_angle_rad;
  // Time over which a new plan's command is faded in [s].
  double fade_plan_s;
  // Time over which the turn to the estimated target is faded in [s].
  double fade_turn_s;
  // Bandwidth of the offset that the wrist camera measures [rad/s].
  double camera_bandwidth_rad_s;
  // The last way: distances that are added, each taken back by itself [m].
  double closing_distances_m[2];
  // Begin and end of the time in which the distances are added, before capture [s]; falling.
  double closing_out_s[2];
  // Begin and end of the time in which each distance is taken back, before capture [s]; falling.
  double closing_back_s[2][2];
  // When the plan's own motion ends, before capture [s].
  double closing_settle_s;
  // When another plan is wanted: age of the plan in force [s].
  double replan_age_s;
  // Error of the centre of mass [m].
  double replan_com_m;
  // Error of the bus attitude [rad].
  double replan_bus_rad;
  // Error of the target's attitude from what the plan expects [rad].
  double replan_target_rad;
  // Time before capture from which none is wanted any more [s].
  double replan_last_s;
  // Abort error of the centre of mass at first [m].
  double abort_settling_com_m;
  // Abort error of the bus attitude at first [rad].
  double abort_settling_bus_rad;
  // Abort error of a joint at first [rad].
  double abort_settling_joint_rad;
  // Abort error of the centre of mass after `abort_settles_s` [m].
  double abort_settled_com_m;
  // Abort error of the bus attitude after `abort_settles_s` [rad].
  double abort_settled_bus_rad;
  // Abort error of a joint after `abort_settles_s` [rad].
  double abort_settled_joint_rad;
  // Time after the first step at which `abort_settled_...` begin to hold [s].
  double abort_settles_s;
  // Abort error of the centre of mass near the target [m].
  double abort_near_com_m;
  // Abort error of the bus attitude near the target [rad].
  double abort_near_bus_rad;
  // Abort error of a joint near the target [rad].
  double abort_near_joint_rad;
  // Times before capture: `abort_near_...` hold from the first, that of the centre of mass to the second [s].
  double abort_near_times_s[2];
  // Most that the end effector may be seen beside the port in the end; twice that is how far across the
  // port's normal it may be going to be off before [m].
  double abort_port_m;
} RemoraGuidance;

// State that navigation estimates at one instant. NaN and infinity are no misuse: guidance then answers the
// planned command with REMORA_FLIGHT_MODE_DEGRADED. Attitudes are (x, y, z, w), of norm 1 within 1e-3.
typedef struct RemoraEstimate {
  // Size of this structure in bytes.
  uint32_t size;
  // Whether `ee_from_port_rtn_m` is given; otherwise it is not read.
  uint32_t has_ee_from_port;
  // Time on the clock that plans are dated by [s].
  double time_s;
  // Centre of mass of the bus alone from the target's, RTN [m]; the scenario's is that of bus and arm.
  double bus_position_rtn_m[3];
  // Its velocity relative to RTN, in RTN [m/s].
  double bus_velocity_rtn_m_s[3];
  // Attitude of the bus.
  double bus_attitude_body_to_rtn[4];
  // Its angular velocity relative to RTN, in RTN [rad/s].
  double bus_rate_rtn_rad_s[3];
  // Joint angles [rad].
  double joint_angle_rad[REMORA_JOINTS];
  // Joint rates [rad/s].
  double joint_rate_rad_s[REMORA_JOINTS];
  // Attitude of the target.
  double target_attitude_body_to_rtn[4];
  // Angular velocity of the target relative to RTN, in RTN [rad/s]; the scenario's is in target axes.
  double target_rate_rtn_rad_s[3];
  // End effector from the port, RTN axes [m], where a camera at the wrist sees it.
  double ee_from_port_rtn_m[3];
} RemoraEstimate;

// Limits of the actuators now; finite and at least zero.
typedef struct RemoraLimits {
  // Size of this structure in bytes.
  uint32_t size;
  // Not read.
  uint32_t reserved;
  // Largest force along each axis, RTN [N].
  double max_bus_force_rtn_n[3];
  // Largest bus torque about each axis, bus axes [N m].
  double max_bus_torque_body_n_m[3];
  // Largest joint torques [N m].
  double max_joint_torque_n_m[REMORA_JOINTS];
} RemoraLimits;

// Commands to the actuators until the next step.
typedef struct RemoraCommand {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // State of guidance.
  RemoraFlightMode mode;
  // Reason why another plan is wanted.
  RemoraReason wanted;
  // Nothing; zero.
  uint32_t reserved;
  // Force on the bus at its centre of mass, RTN [N].
  double bus_force_rtn_n[3];
  // Torque on the bus, bus axes [N m].
  double bus_torque_body_n_m[3];
  // Joint torques; the feed-forward of joints that follow the references below [N m].
  double joint_torque_n_m[REMORA_JOINTS];
  // Angles for joints with servos of their own [rad].
  double joint_angle_rad[REMORA_JOINTS];
  // Their rates [rad/s].
  double joint_rate_rad_s[REMORA_JOINTS];
  // Error of the centre of mass of bus and arm from what is asked for [m].
  double com_error_m;
  // Error of the bus attitude [rad].
  double bus_error_rad;
  // Error of the joint farthest off [rad].
  double joint_error_rad;
  // Error of the target's attitude from what the plan expects [rad].
  double target_error_rad;
  // Share of the force's feedback that the limits leave.
  double force_share;
  // Share of the torques' feedback that the limits leave.
  double torque_share;
} RemoraCommand;

// One link of the arm, in axes that are parallel to the bus's while all joints are at zero.
typedef struct RemoraLink {
  // Vector from its joint to the next one, or for the last link to the end effector [m].
  double tip_from_joint_link_m[3];
  // Centre of mass from its joint [m].
  double com_from_joint_link_m[3];
  // Mass [kg]; 0 where the inertia is zero and the armature is not.
  double mass_kg;
  // Inertia about the centre of mass [kg m^2]; symmetric.
  double inertia_about_com_link_kg_m2[3][3];
  // Unit joint axis.
  double axis_link[3];
  // Inertia of the joint's rotor, times the gear ratio squared [kg m^2].
  double armature_kg_m2;
  // Radius of the capsule that holds the link [m]; it runs from joint to tip but for the next two.
  double radius_m;
  // The capsule's near end from the joint [m].
  double capsule_start_from_joint_link_m[3];
  // The capsule's far end from the tip [m].
  double capsule_end_from_tip_link_m[3];
} RemoraLink;

// Everything that is the same for every approach: orbit, target, servicer, limits, tolerances.
// docs/concepts/problem.md explains each number; remora_defaults fills in the mission of that page. Masses, inertias,
// extents, limits, weights and tolerances are above zero; margins and keep-out distances at least zero.
typedef struct RemoraMission {
  // Size of this structure in bytes.
  uint32_t size;
  // Whether the gravity gradient turns the target.
  RemoraSwitch gravity_gradient;
  // Half edge lengths of the box about the target's centre of mass, target axes [m].
  double target_half_extents_body_m[3];
  // Principal moments of inertia of the target, about its axes [kg m^2].
  double target_inertia_body_kg_m2[3];
  // Mass of the target [kg].
  double target_mass_kg;
  // Docking port from the target's centre of mass, target axes [m].
  double port_position_target_m[3];
  // Outward unit normal of the port, target axes.
  double port_normal_target[3];
  // The body's gravitational parameter [m^3/s^2].
  double gravitational_parameter_m3_s2;
  // Semi-major axis of the target's orbit [m].
  double semi_major_axis_m;
  // Eccentricity of the orbit.
  double eccentricity;
  // Inclination of the orbit [rad].
  double inclination_rad;
  // Mass of the bus [kg].
  double bus_mass_kg;
  // Inertia of the bus about its centre of mass, bus axes [kg m^2]; symmetric.
  double bus_inertia_body_kg_m2[3][3];
  // Half edge lengths of the box about the bus's centre of mass, bus axes [m].
  double bus_half_extents_body_m[3];
  // Unit boresight of the camera, bus axes.
  double boresight_bus[3];
  // First joint from the bus's centre of mass, bus axes [m].
  double arm_base_bus_m[3];
  // The arm, from the bus outwards.
  struct RemoraLink links[REMORA_JOINTS];
  // Lower stops [rad].
  double min_joint_angle_rad[REMORA_JOINTS];
  // Upper stops [rad].
  double max_joint_angle_rad[REMORA_JOINTS];
  // Limits of the joint rates [rad/s].
  double max_joint_rate_rad_s[REMORA_JOINTS];
  // Joint angles at the start, unless a scenario gives others [rad].
  double initial_joint_angle_rad[REMORA_JOINTS];
  // Joint angles at capture [rad].
  double capture_joint_angle_rad[REMORA_JOINTS];
  // Largest force along each axis, RTN [N].
  double max_bus_force_rtn_n[3];
  // Largest bus torque about each axis, bus axes [N m].
  double max_bus_torque_body_n_m[3];
  // Largest joint torques [N m].
  double max_joint_torque_n_m[REMORA_JOINTS];
  // Typical length, by which steps are divided [m].
  double typical_length_m;
  // Typical velocity [m/s].
  double typical_velocity_m_s;
  // Typical force [N].
  double typical_force_n;
  // Typical angle [rad].
  double typical_angle_rad;
  // Typical angular rate [rad/s].
  double typical_rate_rad_s;
  // Typical joint rate [rad/s].
  double typical_joint_rate_rad_s;
  // Typical bus torque [N m].
  double typical_bus_torque_n_m;
  // Typical joint torque [N m].
  double typical_joint_torque_n_m;
  // Whether the members `typical_...` are given; otherwise they are not read, and follow from the rest.
  uint32_t has_typical;
  // Nodes of a plan, 4 to REMORA_NODES.
  uint32_t nodes;
  // Whether bodies must stay clear of each other.
  RemoraSwitch clearance;
  // Whether limits hold between nodes too.
  RemoraSwitch between_nodes;
  // Time from the first node to the last [s].
  double duration_s;
  // Keep-out distance of the system's centre of mass from the target's box before the switch [m].
  double keep_out_far_m;
  // Keep-out distance after the switch [m].
  double keep_out_near_m;
  // Time before the end from which the near distance holds [s].
  double keep_out_near_time_s;
  // Half angle of the camera's cone [rad].
  double field_of_view_half_angle_rad;
  // Time before the end from which the arm has its capture angles [s].
  double preset_time_s;
  // Time within which a start beyond a limit is led back [s].
  double recovery_time_s;
  // Weight of the force in the cost.
  double weight_force;
  // Weight of the force's change from interval to interval.
  double weight_force_change;
  // Weight of the bus torque.
  double weight_bus_torque;
  // Weight of the joint torques.
  double weight_joint_torque;
  // Weight of the joint rates, over typical ones.
  double weight_joint_motion;
  // Tolerance of the dynamics of both stages, over the units of RemoraVerification.
  double tolerance_dynamics;
  // Tolerance of controls, over their limits.
  double tolerance_control;
  // Tolerance of joint stops [rad].
  double tolerance_joint_rad;
  // Tolerance of joint rates, over their limits.
  double tolerance_joint_rate;
  // Tolerance of the field of view, in cosine.
  double tolerance_pointing;
  // Tolerance of the arm's capture angles, over 1 rad and 1e-2 rad/s.
  double tolerance_preset;
  // Tolerance of the bus's rate at capture, over 1e-2 rad/s.
  double tolerance_terminal_rate;
  // Tolerance of the keep-out distance [m].
  double tolerance_keep_out_m;
  // Tolerance of the end effector's position at capture [m].
  double tolerance_ee_position_m;
  // Tolerance of the end effector's direction at capture [rad].
  double tolerance_ee_angle_rad;
  // Tolerance of the clearance of bodies [m].
  double tolerance_clearance_m;
  // Margin to the joint stops [rad].
  double margin_joint_angle_rad;
  // Margin to the joint rate limits, over these limits.
  double margin_joint_rate;
  // Margin to the keep-out distance [m].
  double margin_keep_out_m;
  // Margin to the field of view [rad].
  double margin_field_of_view_rad;
  // Margin of the clearance [m].
  double margin_clearance_m;
  // Half angle of the end effector's corridor [rad].
  double corridor_half_angle_rad;
  // Radius of the corridor at the port [m].
  double corridor_mouth_radius_m;
  // Length of the end effector, which only the corridor concerns [m].
  double corridor_end_effector_length_m;
  // Unit vector in the last link's axes; at capture it is parallel to `roll_port_target`.
  double roll_ee_link[3];
  // Unit vector in the target's axes.
  double roll_port_target[3];
  // Whether the roll at capture is given by the two directions above; otherwise they are not read.
  uint32_t has_roll;
  // Not read.
  uint32_t reserved;
} RemoraMission;

// One approach: the target's tumble, where the servicer starts, and how long it has. RTN is radial, along
// track, orbit normal; quaternions are (x, y, z, w), body to RTN.
typedef struct RemoraScenario {
  // Size of this structure in bytes.
  uint32_t size;
  // Nodes of the plan; 0: the mission's.
  uint32_t nodes;
  // Attitude of the target at t = 0; of norm 1.
  double target_attitude_body_to_rtn[4];
  // Its angular velocity relative to RTN, in target axes [rad/s].
  double target_rate_body_rad_s[3];
  // Centre of mass of bus and arm from the target's at t = 0, RTN [m].
  double com_position_rtn_m[3];
  // Its velocity relative to RTN, in RTN [m/s].
  double com_velocity_rtn_m_s[3];
  // Time from t = 0 to capture [s]; 0: the mission's.
  double duration_s;
  // Whether `bus_attitude_body_to_rtn` is given; otherwise it is not read, and the bus looks at the target.
  uint32_t has_bus_attitude;
  // Whether `joint_angle_rad` is given; otherwise it is not read, and the arm has the mission's initial angles.
  uint32_t has_joint_angle;
  // Attitude of the bus at t = 0; of norm 1.
  double bus_attitude_body_to_rtn[4];
  // Its angular velocity relative to RTN, in RTN [rad/s].
  double bus_rate_rtn_rad_s[3];
  // Joint angles at t = 0 [rad].
  double joint_angle_rad[REMORA_JOINTS];
  // Joint rates at t = 0 [rad/s].
  double joint_rate_rad_s[REMORA_JOINTS];
} RemoraScenario;

// How to plan. remora_defaults fills in: the optimum, RK4 with eight substeps, the heuristic guess, no
// deadline.
typedef struct RemoraOptions {
  // Size of this structure in bytes.
  uint32_t size;
  // Goal at which planning ends.
  RemoraMode mode;
  // Integrator of the plan.
  RemoraIntegrator integrator;
  // Substeps of RK4 in an interval, from 4 to 1000; with Euler not read.
  uint32_t substeps;
  // Time for the whole plan with its verification [s], above 0; INFINITY for none. Needs a clock.
  double deadline_s;
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

// Report on a plan.
typedef struct RemoraReport {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // Whether the verifier found every constraint satisfied: the plan can be flown.
  uint32_t is_verified;
  // Verdict on the plan.
  RemoraVerdict verdict;
  // End of planning.
  RemoraSolveStatus status;
  // Initial guess of Stage 2.
  RemoraStart start;
  // Constraint for which the scenario was refused.
  RemoraRefusal refusal;
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
  double duration_s;
  // When a plan of remora_replan begins, on the clock of the estimates [s]; 0 for others.
  double begins_s;
  // Cost of the path of the centre of mass.
  double cost_1;
  // Cost of attitude and arm.
  double cost_2;
  // Time that planning took by the caller's clock [s]; 0 without one.
  double planning_time_s;
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
  double time_s;
  // Centre of mass of bus and arm from the target's, RTN [m].
  double com_position_rtn_m[3];
  // Its velocity relative to RTN, in RTN [m/s].
  double com_velocity_rtn_m_s[3];
  // Attitude of the bus.
  double bus_attitude_body_to_rtn[4];
  // Its angular velocity relative to RTN, in RTN [rad/s].
  double bus_rate_rtn_rad_s[3];
  // Joint angles [rad].
  double joint_angle_rad[REMORA_JOINTS];
  // Joint rates [rad/s].
  double joint_rate_rad_s[REMORA_JOINTS];
  // Force on the bus at its centre of mass, RTN [N].
  double bus_force_rtn_n[3];
  // Torque on the bus, bus axes [N m].
  double bus_torque_body_n_m[3];
  // Joint torques [N m].
  double joint_torque_n_m[REMORA_JOINTS];
} RemoraNode;

// How near two bodies come to each other.
typedef struct RemoraClosest {
  // Distance of their surfaces [m]; negative where they overlap, infinite where nobody has looked.
  double distance_m;
  // Time since the first node [s].
  double time_s;
  // 0 the bus, then the links, from 1.
  uint32_t body;
  // Nothing; zero.
  uint32_t reserved;
} RemoraClosest;

// Findings of the independent verifier: residuals, zero where a constraint is satisfied, and distances.
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
  double joint_rad;
  // Joint rates beyond their limits, over these.
  double joint_rate;
  // Port out of view, in cosine.
  double pointing;
  // Arm off its capture angles, over 1 rad and 1e-2 rad/s.
  double preset;
  // Rate of the bus relative to the target at capture, over 1e-2 rad/s.
  double terminal_rate;
  // Within the keep-out distance [m].
  double keep_out_m;
  // End effector off the port [m].
  double ee_position_m;
  // End effector off the direction of approach [rad].
  double ee_angle_rad;
  // Overlap of bodies [m].
  double clearance_m;
  // Arm and target.
  struct RemoraClosest arm;
  // Bus and target.
  struct RemoraClosest bus;
  // Arm and its own bus.
  struct RemoraClosest own;
} RemoraVerification;

// A stage in the record.
typedef struct RemoraStage {
  // End of the stage.
  RemoraSolveStatus status;
  // Iterations.
  uint32_t iterations;
  // Second-order corrections.
  uint32_t corrections;
  // Iterations of the solver of all its subproblems.
  uint32_t qp_iterations;
  // Subproblems not solved to full accuracy.
  uint32_t qp_unsolved;
  // Iterate that was left in place of the last one.
  RemoraFallback fallback;
} RemoraStage;

// The record to file with a plan. The same input leaves the same one on every machine: no time is in it.
typedef struct RemoraRecord {
  // Size of this structure in bytes; to be set before the call.
  uint32_t size;
  // End of planning.
  RemoraSolveStatus status;
  // Whether the verifier found every residual within its tolerance.
  uint32_t is_verified;
  // Initial guess of Stage 2.
  RemoraStart start;
  // Limits that the start violates and the plan leads back into: a sum of RemoraRecovery.
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
const char *remora_strerror(RemoraStatus status);

// Makes a flight of memory: at least REMORA_FLIGHT_BYTES, at a multiple of REMORA_ALIGNMENT. It stays the
// caller's. A flight is plain data, which may be copied byte by byte while nobody works in it. `settings` may
// be NULL: the defaults.
//
// # Safety
// `memory` is NULL or `bytes` long; `settings` is NULL or as long as its first member says.
RemoraStatus remora_fly(void *memory, size_t bytes, uint32_t abi, const struct RemoraGuidance *settings);

// Hands the plan in the workspace to a flight; its first node is at `begins_s` on the clock of the estimates
// [s]. A flight that has a plan goes over to this one: the command does not jump. Plans of one flight begin
// at different times.
//
// # Safety
// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, `flight` NULL or REMORA_FLIGHT_BYTES.
RemoraStatus remora_flight_plan(const void *workspace, double begins_s, void *flight);

// One step of guidance, at any rate from 0.2 to 20 Hz: what the actuators are to do from the estimate's time
// to the next step's. `limits` may be NULL: those of the servicer.
//
// REMORA_STATUS_STEP_TIME: the estimate's time is not 0.05 to 5 s after that of the call before, within a tenth.
// No command is written then. A time that is too late, or before that of the last call, is kept all the same:
// the next call is measured from it.
//
// # Safety
// `flight` is NULL or REMORA_FLIGHT_BYTES long, structures are NULL or as long as their first members say.
RemoraStatus remora_guide(void *flight,
                          const struct RemoraEstimate *estimate,
                          const struct RemoraLimits *limits,
                          struct RemoraCommand *command);

// Estimate of a servicer and a target that are exactly where guidance expects them at a step at this time. The
// servicer is on the plan; near capture it is ahead of it and away from the port. It serves tests of software
// around guidance: fed to remora_guide step by step it ends in a capture. Before the plan's first node and after
// its last the target is where it is at that node.
//
// # Safety
// As remora_guide.
RemoraStatus remora_expected(const void *flight,
                             double time_s,
                             struct RemoraEstimate *estimate);

// Asks a flight for another plan, or to leave the target.
//
// # Safety
// `flight` is NULL or REMORA_FLIGHT_BYTES long.
RemoraStatus remora_ask(void *flight, RemoraRequest what);

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

// Plans the rest of a flight's plan again, to take over `lead_s` seconds after the estimate, with that plan
// as the guess; a model is not asked. The flight is read before planning begins and stays as it is: it takes
// the new plan by remora_flight_plan(workspace, report.begins_s, flight). A flight that another thread guides
// meanwhile is given as a copy.
//
// # Safety
// As remora_plan; `flight` is NULL or REMORA_FLIGHT_BYTES long.
RemoraStatus remora_replan(void *workspace,
                           const void *flight,
                           const struct RemoraEstimate *estimate,
                           double lead_s,
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
RemoraStatus remora_self_test(void *workspace, RemoraIntegrator integrator, uint64_t *checksum);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* REMORA_H */
