//! Quality cases Q9, Q10 and Q12 as jobs that a person could write, judged by the files that the runs leave.
use crate::support::write;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::Silent;

/// Columns of a CSV by their heads, rows as written.
fn table(file: &Path, wanted: &[&str]) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at: Vec<usize> = wanted
        .iter()
        .map(|w| heads.iter().position(|h| h == w).unwrap())
        .collect();
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            at.iter().map(|n| cells[*n].parse().unwrap()).collect()
        })
        .collect()
}

fn drawn(folder: &Path, name: &str, job: &str) -> PathBuf {
    let file = write(folder, format!("{name}.toml"), super::previewed(job));
    let out = folder.join(name);
    chain::run(&file, At(&out), &Silent).unwrap();
    out
}

const CHARTS: &str =
    "[charts]\nstop = \"3700 °C\"\nspacing = \"50 µm\"\n[simulation]\nframes = 1\n";

/// Moves with the beam on: ends in the plane, mm.
fn moves(out: &Path) -> Vec<[[f64; 2]; 2]> {
    let rows = table(&out.join("path.csv"), &["x_mm", "y_mm", "on"]);
    rows.windows(2)
        .filter(|w| w[0][2] > 0.5)
        .map(|w| [[w[0][0], w[0][1]], [w[1][0], w[1][1]]])
        .collect()
}

fn length(moves: &[[[f64; 2]; 2]]) -> f64 {
    moves
        .iter()
        .map(|[a, b]| (b[0] - a[0]).hypot(b[1] - a[1]))
        .sum()
}

/// A plate half over metal, half over powder: with modulated speed its temperatures are more even than with constant speed, and
/// no longer hotter over powder. Recorded: nested contours, whose inner rings are short and hot, become less even.
#[test]
fn ebm_q09_modulated_energy_evens_out_an_overhang() {
    let dir = tempfile::tempdir().unwrap();
    // the memory of the ground takes powder below for metal
    let charts = CHARTS.replace("[charts]\n", "[charts]\nmemory = \"none\"\n");
    let run = |name: &str, hatch: &str| {
        let job = format!(
            "[process]\nkind = \"ebm\"\n{charts}[ebm]\nground = \"powder\"\n[region]\ninside = \"0.4 mm\"\ncontour = [[\"0 mm\", \"0 mm\"], [\"6 mm\", \"0 mm\"], [\"6 mm\", \"3 mm\"], [\"0 mm\", \"3 mm\"]]\nsupported = [[\"-1 mm\", \"-1 mm\"], [\"3 mm\", \"-1 mm\"], [\"3 mm\", \"4 mm\"], [\"-1 mm\", \"4 mm\"]]\n{hatch}"
        );
        let out = drawn(dir.path(), name, &job);
        let voxels = table(
            &out.join("series/voxels.csv"),
            &["x_mm", "y_mm", "highest_temperature_C"],
        );
        let moments = |x: std::ops::Range<f64>| {
            let judged = voxels
                .iter()
                .filter(|v| x.contains(&v[0]) && (0.4..2.6).contains(&v[1]))
                .map(|v| v[2]);
            let (n, sum, squares) =
                judged.fold((0.0, 0.0, 0.0), |(n, s, q), t| (n + 1.0, s + t, q + t * t));
            let mean: f64 = sum / n;
            (mean, (squares / n - mean * mean).sqrt())
        };
        let (metal, powder) = (moments(0.4..2.6).0, moments(3.4..5.6).0);
        let even = moments(0.4..5.6).1;
        println!(
            "Q9 {name}: powder {:.0} K above metal, deviation {even:.0} K",
            powder - metal
        );
        (powder - metal, even)
    };
    let law = "[modulation]\nalong = \"92 %\"\nacross = \"97 %\"\n";
    let (step, even) = run("constant", "[hatch]\n");
    let (modulated_step, modulated) = run("speed", &format!("[hatch]\n{law}"));
    assert!(modulated_step.abs() < step.abs(), "{modulated_step} {step}");
    assert!(modulated < even, "{modulated} {even}");
    let (_, contours) = run("contours", "[hatch]\nstrategy = \"contours\"\n");
    let nested = format!("[hatch]\nstrategy = \"modulated\"\n{law}");
    let (_, nested) = run("nested", &nested);
    assert!(
        (0.8..1.3).contains(&(nested / contours)),
        "{nested} {contours}"
    );
}

/// A rectangle with powder beside it: passes lie farther apart near its sides than inside, and their path is shorter than
/// that of contours at constant spacing.
#[test]
fn ebm_q10_passes_lie_farther_apart_near_powder() {
    let dir = tempfile::tempdir().unwrap();
    let job = |hatch: &str| {
        format!(
            "[process]\nkind = \"ebm\"\n{CHARTS}voxel = \"0.2 mm\"\n[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"6 mm\", \"0 mm\"], [\"6 mm\", \"4 mm\"], [\"0 mm\", \"4 mm\"]]\n{hatch}"
        )
    };
    let law = "[hatch]\nstrategy = \"modulated\"\n[modulation]\nacross = \"70 %\"\nacross_length = \"1 mm\"\n";
    let modulated = moves(&drawn(dir.path(), "modulated", &job(law)));
    let plain = "[hatch]\nstrategy = \"contours\"\n";
    let constant = moves(&drawn(dir.path(), "contours", &job(plain)));
    let [ours, theirs] = [&modulated, &constant].map(|m| length(m));
    println!("Q10: {ours:.1} mm modulated, {theirs:.1} mm at constant spacing");
    assert!(ours < 0.97 * theirs, "{ours} {theirs}");
    // where passes cross the middle of the left side
    let crossings = |moves: &[[[f64; 2]; 2]]| {
        let mut x: Vec<f64> = moves
            .iter()
            .filter(|[a, b]| (a[1] - 2.0) * (b[1] - 2.0) < 0.0)
            .map(|[a, b]| a[0] + (2.0 - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
            .filter(|x| *x < 2.0)
            .collect();
        x.sort_by(f64::total_cmp);
        x
    };
    let gaps = |x: &[f64]| x.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>();
    let (ours, theirs) = (gaps(&crossings(&modulated)), gaps(&crossings(&constant)));
    println!("Q10: gaps from the side inwards {ours:.3?} mm, constant {theirs:.3?} mm");
    let last = *ours.last().unwrap();
    assert!(ours[0] > 1.15 * last, "{ours:?}");
    assert!(
        (theirs[0] / theirs.last().unwrap() - 1.0).abs() < 0.02,
        "{theirs:?}"
    );
}

/// Two squares of lines, 12 mm apart; `which` are drawn.
fn squares(which: &[f64]) -> String {
    let mut text = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n".to_owned();
    let mut time = 0.0;
    for x0 in which {
        // where steps and batches of the simulation begin anew: else a part is drawn half a step apart, which is 20 K
        time = (f64::ceil(time / 4e-5 - 1e-6)) * 4e-5;
        for n in 0..9 {
            let y = 0.125 * f64::from(n);
            let ends = if n % 2 == 0 { [0.0, 1.2] } else { [1.2, 0.0] };
            for (m, x) in ends.into_iter().enumerate() {
                let on = u8::from(!(n == 8 && m == 1));
                writeln!(text, "{time},{},{y},60000,0.005,0.004,{on}", x0 + x).unwrap();
                time += [1.2, 0.125][m] / 980.0;
            }
        }
    }
    text
}

/// Parts far apart do not feel each other, without and hardly with a memory of what the beam left before.
#[test]
fn ebm_q12_parts_far_apart_are_drawn_together_as_alone() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    for memory in ["none", "ground"] {
        let voxels = |name: &str, which: &[f64]| {
            let name = format!("{name}-{memory}");
            std::fs::write(folder.join(format!("{name}.csv")), squares(which)).unwrap();
            // a whole number of voxels from part to part
            let job = format!(
                "path = \"{name}.csv\"\n[process]\nkind = \"ebm\"\n{}voxel = \"60 µm\"\n",
                CHARTS.replace("[charts]\n", &format!("[charts]\nmemory = \"{memory}\"\n"))
            );
            let out = drawn(folder, &name, &job);
            table(
                &out.join("series/voxels.csv"),
                &["x_mm", "y_mm", "highest_temperature_C"],
            )
        };
        let alone = [voxels("left", &[0.0]), voxels("right", &[12.0])];
        let together = voxels("both", &[0.0, 12.0]);
        let mut worst = 0.0_f64;
        let mut found = 0;
        for a in alone.iter().flatten() {
            let near = |b: &&Vec<f64>| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-6;
            if let Some(b) = together.iter().find(near) {
                worst = worst.max((a[2] - b[2]).abs());
                found += 1;
            }
        }
        let all: usize = alone.iter().map(Vec::len).sum();
        println!("Q12, memory {memory}: {found} of {all} voxels, apart by at most {worst:.3} K");
        assert_eq!([found, together.len()], [all, all]);
        // recorded: 4 K with memory, whose heat is folded in spans of time counted from the start of the path
        let most = if memory == "none" { 0.1 } else { 5.0 };
        assert!(worst < most, "{worst}");
    }
}
