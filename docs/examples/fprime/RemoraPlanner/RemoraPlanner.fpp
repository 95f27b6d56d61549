module Remora {

  array Vector3 = [3] F64

  @ (x, y, z, w), body to RTN
  array Quaternion = [4] F64

  @ How to end planning
  enum Goal : U8 {
    OPTIMAL @< With the optimum
    FEASIBLE @< With the first plan that satisfies every constraint
  }

  @ Integrator of a plan
  enum Integrator : U8 {
    RK4 @< Its plans can be flown
    EULER @< The paper's; its plans cannot
  }

  @ What guidance does
  enum FlightMode : U8 {
    TRACK @< Tracks the plan
    REPLAN_WANTED @< Tracks the plan and wants another
    DEGRADED @< The estimate is no number: what is planned goes out as it stands
    ABORT @< Leaves the target
    DONE @< The plan's time is over
    NO_PLAN @< Nothing is flown
  }

  @ One approach: the target's tumble, and where the servicer starts; RTN
  struct Scenario {
    targetAttitude: Quaternion
    targetRateBody: Vector3 @< Target axes [rad/s]
    comPosition: Vector3 @< Centre of mass of bus and arm [m]
    comVelocity: Vector3 @< [m/s]
    duration: F64 @< From the first node to capture [s]; 0: the mission's
  }

  @ What navigation knows at one instant; RTN, but for the joints
  struct Estimate {
    $time: F64 @< On the clock that plans are dated by [s]
    busPosition: Vector3 @< Centre of mass of the bus alone from the target's [m]
    busVelocity: Vector3 @< [m/s]
    busAttitude: Quaternion
    busRate: Vector3 @< [rad/s]
    jointAngle: Vector3 @< [rad]
    jointRate: Vector3 @< [rad/s]
    targetAttitude: Quaternion
    targetRateRtn: Vector3 @< RTN, not target axes [rad/s]
    hasEeFromPort: bool @< Whether a camera at the wrist sees the port
    eeFromPort: Vector3 @< End effector from the port [m]
  }

  @ What the actuators are to do until the next step
  struct Command {
    mode: FlightMode
    force: Vector3 @< On the bus, RTN [N]
    busTorque: Vector3 @< Bus axes [N m]
    jointTorque: Vector3 @< [N m]
    jointAngle: Vector3 @< For joints with servos of their own [rad]
    jointRate: Vector3 @< Likewise [rad/s]
  }

  port EstimateUpdate(ref estimate: Estimate)

  port CommandUpdate(ref $command: Command)

  @ Plans approaches to a tumbling target on its own thread; guides along the plan on a rate group's
  active component RemoraPlanner {

    @ A step of guidance, at 0.2 to 20 Hz
    guarded input port schedIn: Svc.Sched

    @ The newest estimate, before the step that it is for
    guarded input port estimateIn: EstimateUpdate

    @ What a step of guidance asks of the actuators
    output port commandOut: CommandUpdate

    @ Plans an approach; the plan before is gone then
    async command PLAN(scenario: Scenario) opcode 0

    @ Hands the plan to guidance
    async command FLY(begins: F64 @< Time of its first node on the clock of the estimates [s]
                     ) opcode 1

    @ Plans again what is left, to take over from the plan in force
    async command REPLAN(lead: F64 @< Time from the newest estimate to then [s]
                        ) opcode 2

    @ Leaves the target, from the next step on; there is no way back
    guarded command ABORT opcode 3

    @ Plans a built-in scenario and compares the plan's checksum
    async command SELF_TEST opcode 4

    @ How to end planning
    param GOAL: Goal default Goal.OPTIMAL id 0

    @ Integrator of a plan
    param INTEGRATOR: Integrator default Integrator.RK4 id 1

    @ Substeps of RK4 in an interval
    param SUBSTEPS: U32 default 8 id 2

    @ Time for a plan [s]; 0: as long as it takes
    param DEADLINE: F64 default 0.0 id 3

    @ Whether the learned model makes the initial guess, where there is one
    param LEARNED: bool default true id 4

    @ Plans made
    telemetry Plans: U32 id 0 update on change

    @ Time of the last plan [s]
    telemetry LastSeconds: F64 id 1

    @ Mean time of a plan [s]
    telemetry MeanSeconds: F64 id 2

    @ Longest time of a plan [s]
    telemetry LongestSeconds: F64 id 3

    @ What became of planning: RemoraStatus
    telemetry PlanStatus: U32 id 4 update on change

    @ 0 optimal, 1 verified but not converged, 2 not flyable
    telemetry Verdict: U32 id 5 update on change

    @ Checksum of the last plan: the same behind every door of Remora
    telemetry Checksum: U64 id 6 update on change format "{x}"

    @ What guidance does
    telemetry Mode: FlightMode id 7 update on change

    @ Errors from the plan: centre of mass [m], attitude, the joint farthest off [rad]
    telemetry TrackingError: Vector3 id 8

    @ Steps of guidance without a new estimate
    telemetry MissedEstimates: U32 id 9 update on change

    @ What became of guidance: RemoraStatus
    telemetry GuideStatus: U32 id 10 update on change

    @ A plan is there
    event Planned(checksum: U64, verdict: U32, seconds: F64) \
      severity activity high id 0 format "plan {x}, verdict {}, {} s"

    @ No plan can end well
    event Refused(constraint: string size 16) severity warning high id 1 format "refused: {}"

    @ A call of the archive failed
    event Failed(what: string size 16, why: string size 80) severity warning high id 2 format "{}: {}" throttle 10

    @ The planner makes the bits that it must make
    event SelfTestPassed(checksum: U64) severity activity high id 3 format "self-test passed: {x}"

    @ Guidance flies a plan
    event Flying(begins: F64) severity activity high id 4 format "flies the plan that begins at {} s"

    @ Guidance wants another plan: 1 time, 2 error, 3 tumble, 4 asked for
    event ReplanWanted(reason: U32) severity warning low id 5 format "another plan is wanted: {}"

    @ The target is being left
    event Leaving severity warning high id 6 format "leaves the target"

    @ The learned model was not used: damaged, or for other plans
    event ModelNotUsed(start: U32) severity warning low id 7 format "initial guess is the heuristic's: {}"

    command recv port cmdIn

    command reg port cmdRegOut

    command resp port cmdResponseOut

    event port eventOut

    text event port textEventOut

    telemetry port tlmOut

    time get port timeGetOut

    param get port prmGetOut

    param set port prmSetOut

  }

}
