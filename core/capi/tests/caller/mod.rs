//! A caller as one in C: memory, structures, and the functions over them.
#![allow(unsafe_code, reason = "calls what C calls")]
#![allow(dead_code, reason = "two programs of tests use this file")]

use remora_capi::*;
use std::ffi::c_void;
use std::mem::MaybeUninit;

/// Memory as C has it: some bytes more than needed, the first aligned one first.
pub struct Memory {
    pub bytes: Vec<u8>,
    pub offset: usize,
    pub length: usize,
}

impl Memory {
    /// Filled with a pattern, so that a byte that is written shows.
    pub fn new(length: usize) -> Self {
        let bytes = vec![0xa5; length + 2 * REMORA_ALIGNMENT];
        let offset = bytes.as_ptr().align_offset(REMORA_ALIGNMENT);
        Self { bytes, offset, length }
    }

    /// As a caller in C has it: one that was asked for earlier stays good.
    pub fn pointer(&mut self) -> *mut c_void {
        self.bytes.as_mut_ptr().wrapping_add(self.offset).cast()
    }

    pub fn contents(&self) -> &[u8] {
        &self.bytes[self.offset..self.offset + self.length]
    }
}

/// What lies in memory at another place: workspaces and flights are plain data.
impl Clone for Memory {
    fn clone(&self) -> Self {
        let mut copy = Self::new(self.length);
        // SAFETY: both are as long as that, and no byte is looked at: of padding nothing may be known.
        unsafe {
            let from = self.bytes.as_ptr().wrapping_add(self.offset).cast::<MaybeUninit<u8>>();
            from.copy_to_nonoverlapping(copy.pointer().cast(), self.length);
        }
        copy
    }
}

/// A workspace, a flight and what is handed to the functions.
#[derive(Clone)]
pub struct Caller {
    pub workspace: Memory,
    pub flight: Memory,
    pub mission: RemoraMission,
    pub scenario: RemoraScenario,
    pub options: RemoraOptions,
    pub settings: RemoraGuidance,
    pub report: RemoraReport,
    pub node: RemoraNode,
    pub estimate: RemoraEstimate,
    pub command: RemoraCommand,
}

/// A structure of zeros with its size.
pub fn sized<T>(set: fn(&mut T, u32)) -> T {
    // SAFETY: the structures are numbers, and zero is one.
    let mut value: T = unsafe { std::mem::zeroed() };
    set(&mut value, size_of::<T>() as u32);
    value
}

impl Caller {
    /// One who has only room so far.
    pub fn new() -> Self {
        let mut caller = Self {
            workspace: Memory::new(REMORA_WORKSPACE_BYTES),
            flight: Memory::new(REMORA_FLIGHT_BYTES),
            mission: sized(|s, size| s.size = size),
            scenario: sized(|s, size| s.size = size),
            options: sized(|s, size| s.size = size),
            settings: sized(|s, size| s.size = size),
            report: sized(|s, size| s.size = size),
            node: sized(|s, size| s.size = size),
            estimate: sized(|s, size| s.size = size),
            command: sized(|s, size| s.size = size),
        };
        let Self { mission, scenario, options, settings, .. } = &mut caller;
        // SAFETY: places for the structures.
        let status = unsafe { remora_defaults(REMORA_ABI, mission, scenario, options, settings) };
        assert_eq!(status, RemoraStatus::Ok);
        caller.scenario.com_position_rtn_m = [8.0, 0.0, 0.0];
        caller.options.mode = RemoraMode::Feasible as u32;
        caller
    }

    /// One with an open workspace.
    pub fn open() -> Self {
        let mut caller = Self::new();
        assert_eq!(caller.opens(REMORA_ABI), RemoraStatus::Ok);
        caller
    }

    /// One with a plan.
    pub fn planned() -> Self {
        let mut caller = Self::open();
        assert_eq!(caller.plans(), RemoraStatus::Ok);
        assert_eq!(caller.report.is_verified, 1);
        caller
    }

    /// One with an open workspace who asks for little, so that an interpreter plans it in minutes: few nodes, the last
    /// half of the way, tolerances so many times as large, limits at nodes only, and bodies may come near each other.
    pub fn asking_little(nodes: u32, integrator: RemoraIntegrator, rough: f64) -> Self {
        let mut caller = Self::new();
        let mission = &mut caller.mission;
        (mission.clearance, mission.between_nodes) =
            (RemoraSwitch::Off as u32, RemoraSwitch::Off as u32);
        for tolerance in [
            &mut mission.tolerance_dynamics,
            &mut mission.tolerance_control,
            &mut mission.tolerance_joint_rad,
            &mut mission.tolerance_joint_rate,
            &mut mission.tolerance_pointing,
            &mut mission.tolerance_preset,
            &mut mission.tolerance_terminal_rate,
            &mut mission.tolerance_keep_out_m,
            &mut mission.tolerance_ee_position_m,
            &mut mission.tolerance_ee_angle_rad,
            &mut mission.tolerance_clearance_m,
        ] {
            *tolerance *= rough;
        }
        caller.scenario.com_position_rtn_m = [4.0, 0.0, 0.0];
        (caller.scenario.nodes, caller.scenario.duration_s) = (nodes, 600.0);
        (caller.options.integrator, caller.options.substeps) = (integrator as u32, 4);
        assert_eq!(caller.opens(REMORA_ABI), RemoraStatus::Ok);
        caller
    }

    /// One with a plan of that.
    pub fn planned_little(nodes: u32, integrator: RemoraIntegrator, rough: f64) -> Self {
        let mut caller = Self::asking_little(nodes, integrator, rough);
        assert_eq!(caller.plans(), RemoraStatus::Ok);
        assert_eq!((caller.report.is_verified, caller.report.nodes), (1, nodes));
        caller
    }

    /// One who flies it.
    pub fn flying() -> Self {
        let mut caller = Self::planned();
        caller.takes_off();
        caller
    }

    /// Flies the plan from its first node on, and knows where it is 300 s later.
    pub fn takes_off(&mut self) {
        assert_eq!(self.flies(), RemoraStatus::Ok);
        assert_eq!(self.hands_over(0.0), RemoraStatus::Ok);
        self.expects(300.0);
    }

    /// Knows what guidance expects at a time.
    pub fn expects(&mut self, time_s: f64) {
        // SAFETY: as below.
        let status = unsafe { remora_expected(self.flight.pointer(), time_s, &mut self.estimate) };
        assert_eq!(status, RemoraStatus::Ok);
    }

    pub fn opens(&mut self, abi: u32) -> RemoraStatus {
        let bytes = self.workspace.length;
        // SAFETY: memory and structures of this, here and below.
        unsafe { remora_open(self.workspace.pointer(), bytes, abi, &self.mission) }
    }

    pub fn plans(&mut self) -> RemoraStatus {
        // SAFETY: as above.
        unsafe {
            let workspace = self.workspace.pointer();
            remora_plan(workspace, &self.scenario, &self.options, &mut self.report)
        }
    }

    pub fn replans(&mut self, lead_s: f64) -> RemoraStatus {
        let (workspace, flight) = (self.workspace.pointer(), self.flight.pointer());
        let Self { estimate, options, report, .. } = self;
        // SAFETY: as above.
        unsafe { remora_replan(workspace, flight, estimate, lead_s, options, report) }
    }

    pub fn flies(&mut self) -> RemoraStatus {
        // SAFETY: as above.
        unsafe {
            remora_fly(self.flight.pointer(), REMORA_FLIGHT_BYTES, REMORA_ABI, &self.settings)
        }
    }

    pub fn hands_over(&mut self, begins_s: f64) -> RemoraStatus {
        // SAFETY: as above.
        unsafe { remora_flight_plan(self.workspace.pointer(), begins_s, self.flight.pointer()) }
    }

    pub fn guides(&mut self, limits: Option<&RemoraLimits>) -> RemoraStatus {
        let flight = self.flight.pointer();
        let limits = limits.map_or(std::ptr::null(), |limits| &raw const *limits);
        // SAFETY: as above.
        unsafe { remora_guide(flight, &self.estimate, limits, &mut self.command) }
    }

    pub fn copies_node(&mut self, index: u32) -> RemoraStatus {
        // SAFETY: as above.
        unsafe { remora_node(self.workspace.pointer(), index, &mut self.node) }
    }

    /// All that a call might change.
    pub fn everything(&self) -> Vec<u8> {
        // An interpreter lets nobody look at the padding of what was put there.
        let mut all = Vec::new();
        if !cfg!(miri) {
            all.extend(self.workspace.contents());
            all.extend(self.flight.contents());
        }
        all.extend(format!("{:?}", self.report).bytes());
        all.extend(format!("{:?}{:?}", self.node, self.command).bytes());
        all
    }
}
