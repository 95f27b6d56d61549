//! scratch
use remora_core::{
    dynamics::Integrator,
    model::*,
    planner::{Options, plan},
    scp::{Clock, Status},
    stages::*,
};
use remora_host::backend::ClarabelQp;
use std::time::Instant;
struct Wall(Instant);
impl Clock for Wall {
    fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}
fn v3(v: &serde_json::Value) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::from_fn(|i, _| v[i].as_f64().unwrap())
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let count: usize = args.get(1).map_or(60, |s| s.parse().unwrap());
    let integ = match args.get(2).map(|s| s.as_str()) {
        Some("rk4") => Integrator::Rk4 { substeps: 4 },
        _ => Integrator::Euler,
    };
    let mode = match args.get(3).map(|s| s.as_str()) {
        Some("feasible") => Mode::Feasible,
        _ => Mode::Optimal,
    };
    let verbose = args.get(4).is_some();
    let dir = "fixtures/";
    let sc: serde_json::Value = serde_json::from_str(
        &std::fs::read_to_string(format!("{dir}scenarios/public.scenarios.json")).unwrap(),
    )
    .unwrap();
    let rf: serde_json::Value = serde_json::from_str(
        &std::fs::read_to_string(format!("{dir}oracle/reference_public.json")).unwrap(),
    )
    .unwrap();
    let mission = Mission::default();
    let mut ws = Box::new(remora_core::planner::Workspace::new());
    println!("workspace {} bytes", remora_core::planner::Workspace::BYTES);
    let (
        mut it,
        mut corr,
        mut time,
        mut cost,
        mut refc,
        mut solved,
        mut within,
        mut qps,
        mut worst1,
    ) = (0, 0, 0.0, 0.0, 0.0, 0, 0, 0, 0.0f64);
    let (mut t1, mut i1) = (0.0, 0);
    for k in 0..count {
        let s = &sc["scenarios"][k];
        let q = &s["target"]["attitude"];
        let scenario = Scenario {
            target_attitude: nalgebra::Vector4::from_fn(|i, _| q[i].as_f64().unwrap()),
            target_rate: v3(&s["target"]["rate"]),
            position: v3(&s["servicer"]["position"]),
            velocity: v3(&s["servicer"]["velocity"]),
        };
        let (mut a, mut b) = (ClarabelQp::default(), ClarabelQp::default());
        let mut options = Options::new(mode, integ);
        let env = |n: &str, d: f64| std::env::var(n).map_or(d, |s| s.parse().unwrap());
        let o = &mut options.reorientation;
        o.radius = env("RAD", o.radius);
        o.weight = env("W", o.weight);
        o.curvature_below = env("CURV", o.curvature_below);
        o.max_corrections = env("CORR", o.max_corrections as f64) as u32;
        o.max_radius = env("MAXR", o.max_radius);
        o.correct_below = env("CB", o.correct_below);
        o.settle = env("SETTLE", o.settle);
        let r =
            plan(&mission, &scenario, &options, (&mut a, &mut b), &Wall(Instant::now()), &mut ws);
        let r1 = rf["scenarios"][k]["stage1"]["cost"].as_f64().unwrap();
        let r2 = rf["scenarios"][k]["rate_limited"]["cost"].as_f64().unwrap();
        let d1 = r.translation.cost / r1 - 1.0;
        let d2 = r.reorientation.cost / r2 - 1.0;
        worst1 = worst1.max(d1.abs());
        if std::env::var("QUIET").is_err() {
            println!(
                "{k:3} {:?} s1 {:?} it {} d {:+.1e} t {:.3} | s2 {:?} it {} corr {} cost {:.5} ref {:.5} {:+.3}% t {:.3} qpit {}",
                r.status,
                r.translation.outcome.status,
                r.translation.outcome.iterations,
                d1,
                r.translation.time_s,
                r.reorientation.outcome.status,
                r.reorientation.outcome.iterations,
                r.reorientation.outcome.corrections,
                r.reorientation.cost,
                r2,
                d2 * 100.0,
                r.reorientation.time_s,
                ws.logs().1.iter().map(|l| l.qp_iterations).sum::<u32>()
            );
        }
        if std::env::var("ROLL").is_ok() {
            let rq = &rf["scenarios"][k]["rate_limited"]["terminal_state"]["q"];
            let rq = nalgebra::Vector4::from_fn(|i, _| rq[i].as_f64().unwrap());
            let q = ws.motion().states[59].attitude;
            let st = &ws.motion().states;
            println!(
                "{k} d2 {:+.2}% angle to ref {:.3} rad, alpha mid {:?} {:?}",
                d2 * 100.0,
                2.0 * q.dot(&rq).abs().min(1.0).acos(),
                st[20].joint_angle.as_slice(),
                st[40].joint_angle.as_slice()
            );
            let mut g = (0.0f64, 0.0f64, 0.0f64);
            for s in st {
                for j in 0..3 {
                    let m = &mut [&mut g.0, &mut g.1, &mut g.2][j];
                    **m = m.max(s.joint_angle[j].abs());
                }
            }
            println!(
                "   max joint {g:?} n_rate {} ",
                st.iter()
                    .map(|s| s.joint_rate.iter().filter(|r| r.abs() > 4.99e-3).count())
                    .sum::<usize>()
            );
        }
        if verbose {
            for l in ws.logs().1 {
                println!(
                    "   cost {:.5} pen {:.2e} act {:+.2e} pred {:+.2e} ratio {:+.3} rad {:.2e} step {:.2e} t {} w {:.0} viol {:.2e} acc {} qp {} {:?} corr {} t {:.4}",
                    l.cost,
                    l.penalty,
                    l.actual,
                    l.predicted,
                    l.ratio,
                    l.radius,
                    l.step,
                    l.length,
                    l.weight,
                    l.violation,
                    l.accepted as u8,
                    l.qp_iterations,
                    l.qp_status,
                    l.corrections,
                    l.qp_time_s
                );
            }
            println!("   {:?}", r.residuals);
        }
        it += r.reorientation.outcome.iterations;
        corr += r.reorientation.outcome.corrections;
        time += r.reorientation.time_s;
        cost += r.reorientation.cost;
        refc += r2;
        solved += (r.status == Status::Solved) as usize;
        within += (d2 < 0.01) as usize;
        qps += ws.logs().1.iter().map(|l| l.qp_iterations).sum::<u32>();
        t1 += r.translation.time_s;
        i1 += r.translation.outcome.iterations;
    }
    let c = count as f64;
    println!(
        "solved {solved}/{count} it {:.2} corr {:.2} time {:.4} cost {:.5} ref {:.5} ratio {:.4} within1% {within} qpit {:.1} | s1 worst {worst1:.1e} it {:.2} t {:.3}",
        it as f64 / c,
        corr as f64 / c,
        time / c,
        cost / c,
        refc / c,
        cost / refc,
        qps as f64 / c,
        i1 as f64 / c,
        t1 / c
    );
}
