//! Report of `remora mission show`.

use super::{Table, number};
use remora_host::vehicle::{Margin, Vehicle};

/// Geometry, masses, the joints' ways, margins, and whether an approach can end.
pub fn vehicle_report(vehicle: &Vehicle) -> String {
    let verdict = match &vehicle.refused {
        None => "nothing forbids an approach to end".into(),
        Some(refused) => format!("infeasible\n{}", refused.reason),
    };
    let margins = margins(vehicle);
    format!("{}\n{}\n{margins}\n{verdict}\n", numbers(vehicle), joints(vehicle))
}

fn numbers(vehicle: &Vehicle) -> Table {
    let mut table = Table::new("number | >value | unit | ");
    let mut row = |name: &str, value: String, unit: &str, note: &str| {
        table.row([name.into(), value, unit.into(), note.into()]);
    };
    let metres = |x: f64| format!("{x:.4}");
    row("reach", metres(vehicle.reach_m), "m", "centre of mass to end effector at capture");
    row("extension", metres(vehicle.extension_m), "m", "the same, arm at its most extended");
    row("keep-out, far", metres(vehicle.keep_out_far_m), "m", "centre of mass to target's box");
    row("keep-out, near", metres(vehicle.keep_out_near_m), "m", "the same, later");
    row("mass of bus", number(vehicle.bus_mass_kg), "kg", "");
    row("mass of arm", number(vehicle.arm_mass_kg), "kg", "");
    row("mass of system", number(vehicle.system_mass_kg), "kg", "");
    let diagonal = |m: &[[f64; 3]; 3]| {
        let [x, y, z] = [m[0][0], m[1][1], m[2][2]].map(number);
        format!("{x} {y} {z}")
    };
    let about = "xx yy zz about the centre of mass, bus axes";
    row("inertia at start", diagonal(&vehicle.inertia_at_start_kg_m2), "kg m^2", about);
    row("inertia at capture", diagonal(&vehicle.inertia_at_capture_kg_m2), "kg m^2", "the same");
    let typical = &vehicle.typical;
    let divides = "typical: what steps are divided by";
    row("velocity", number(typical.velocity_m_s), "m/s", divides);
    row("force", number(typical.force_n), "N", "typical");
    row(
        "rates of bus and joints",
        two(typical.rate_rad_s, typical.joint_rate_rad_s),
        "rad/s",
        "typical",
    );
    let torques = two(typical.bus_torque_n_m, typical.joint_torque_n_m);
    row("torques of bus and joints", torques, "N m", "typical");
    table
}

fn two(first: f64, second: f64) -> String {
    format!("{} {}", number(first), number(second))
}

fn joints(vehicle: &Vehicle) -> Table {
    let mut table = Table::new("joint | >travel | >needs | >has until preset");
    for (i, joint) in vehicle.joints.iter().enumerate() {
        table.row([
            (i + 1).to_string(),
            format!("{:.1} deg", joint.travel_rad.to_degrees()),
            format!("{:.0} s", joint.needed_s),
            format!("{:.0} s", joint.available_s),
        ]);
    }
    table
}

/// Torque and momentum that the fastest scenario needs, those available, and the reason if one is unknown.
fn margins(vehicle: &Vehicle) -> String {
    let mut table = Table::new("fastest scenario | >needs | >has | >times | unit");
    let mut reasons = String::new();
    let mut row = |name: &str, margin: &Margin, unit: &str| {
        let [needed, available, factor] = [margin.needed, margin.available, margin.factor()]
            .map(|x| x.map_or("-".into(), number));
        table.row([name.into(), needed, available, factor, unit.into()]);
        let nothing = || margin.factor().is_none().then_some("nothing is needed");
        if let Some(reason) = margin.unknown.as_deref().or_else(nothing) {
            reasons += &format!("{name}: {reason}\n");
        }
    };
    row("spin-up of the bus", &vehicle.spin_up, "N m");
    row("momentum of the bus", &vehicle.momentum, "N m s");
    row("force, at least", &vehicle.force, "N");
    row("turn of target a node", &vehicle.turn, "deg");
    format!("{table}{reasons}")
}
