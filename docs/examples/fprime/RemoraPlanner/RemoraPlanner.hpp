// Plans on the component's thread, guides on a rate group's. The planner's workspace belongs to the former, the
// flight to whoever holds the component's lock.
#ifndef REMORA_PLANNER_HPP
#define REMORA_PLANNER_HPP

#include "RemoraPlannerComponentAc.hpp"

#include <remora.h>

namespace Remora {

class RemoraPlanner : public RemoraPlannerComponentBase {
  public:
    explicit RemoraPlanner(const char* compName);

    //! Opens the workspace for a mission and makes a flight with settings of guidance, nullptr for the defaults.
    //! The learned model stays where it lies; nullptr for none. To be called before the component starts.
    RemoraStatus configure(const RemoraMission& mission, const RemoraGuidance* guidance, const U8* model, size_t bytes);

  private:
    // Handlers. FPP 3.0 hands a structure over by value, later versions by reference: of the two for PLAN the base
    // class knows one, which is why none is marked as an override.
    void schedIn_handler(FwIndexType portNum, U32 context);
    void estimateIn_handler(FwIndexType portNum, Estimate& estimate);
    void PLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, Scenario scenario);
    void PLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, const Scenario& scenario);
    void FLY_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 begins);
    void REPLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 lead);
    void ABORT_cmdHandler(FwOpcodeType opCode, U32 cmdSeq);
    void SELF_TEST_cmdHandler(FwOpcodeType opCode, U32 cmdSeq);

    //! Plans an approach, and answers the command.
    void plan(FwOpcodeType opCode, U32 cmdSeq, const Scenario& scenario);
    //! Whether a plan waits for its time: until then nobody may write the workspace. Answers the command if so.
    bool isBusy(FwOpcodeType opCode, U32 cmdSeq);
    //! How to plan, by the parameters.
    RemoraOptions options();
    //! Tells the ground what became of planning; the answer to the command.
    Fw::CmdResponse planned(RemoraStatus status);
    //! Tells the ground of a call that failed.
    void warn(const char* what, RemoraStatus status);
    //! Likewise of one of guidance; whether it failed.
    bool guidanceFailed(const char* what, RemoraStatus status);
    //! Hands the plan in the workspace to the flight once its time has come.
    void takeOver();
    //! Sends a command, and tells the ground where guidance wants something.
    void send(const RemoraCommand& command);
    //! Seconds of the component's time, for the planner.
    static double clock(void* context);

    // The component's thread.
    alignas(REMORA_ALIGNMENT) U8 m_workspace[REMORA_WORKSPACE_BYTES] = {};
    alignas(REMORA_ALIGNMENT) U8 m_copy[REMORA_FLIGHT_BYTES] = {};
    const U8* m_model = nullptr;
    size_t m_modelBytes = 0;
    RemoraReport m_report = RemoraReport();
    U32 m_plans = 0;
    F64 m_sumSeconds = 0.0;
    F64 m_longestSeconds = 0.0;

    // Under the lock.
    alignas(REMORA_ALIGNMENT) U8 m_flight[REMORA_FLIGHT_BYTES] = {};
    RemoraEstimate m_estimate = RemoraEstimate();
    bool m_isFresh = false;    //!< Whether the estimate is newer than the last step
    bool m_isFlying = false;
    bool m_isWaiting = false;  //!< Whether the plan in the workspace waits for its time
    F64 m_begins = 0.0;        //!< That time [s]
    U32 m_missed = 0;
    U32 m_wanted = 0;          //!< Why guidance wants another plan; 0: it does not
    U32 m_mode = FlightMode::NO_PLAN;
};

}  // namespace Remora

#endif
