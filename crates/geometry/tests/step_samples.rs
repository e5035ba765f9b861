//! Scratch: reads and measures samples.
use meltpath_base::{Reporter, Silent};
use meltpath_geometry::{brep::{self, Tolerance}, step};
use std::collections::HashMap;

#[test]
fn scratch() {
    let Ok(list) = std::env::var("STEP_FILES") else { return };
    let chord: f64 = std::env::var("CHORD").ok().and_then(|c| c.parse().ok()).unwrap_or(0.01);
    for path in list.split_whitespace() {
        let bytes = std::fs::read(path).unwrap();
        let reporter = Reporter::new();
        let t0 = std::time::Instant::now();
        let model = match step::parse(&bytes, &reporter) {
            Ok(m) => m,
            Err(e) => { println!("{path}: READ {e}"); continue; }
        };
        let t1 = t0.elapsed();
        let tol = Tolerance::with_chord(chord);
        let t0 = std::time::Instant::now();
        let mesh = match brep::tessellate(&model, &tol, &reporter, &Silent) {
            Ok(m) => m,
            Err(e) => { println!("{path}: MESH {e}"); continue; }
        };
        let t2 = t0.elapsed();
        let t0 = std::time::Instant::now();
        let mass = brep::tessellate::measure_model(&model, &tol, &Silent).unwrap();
        let t3 = t0.elapsed();
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        let mut dup = 0;
        for t in &mesh.triangles { for k in 0..3 {
            let e = edges.entry([t[k], t[(k+1)%3]]).or_default(); *e += 1; if *e > 1 { dup += 1; }
        }}
        let open = edges.iter().filter(|(k, v)| edges.get(&[k[1], k[0]]).copied().unwrap_or(0) != **v).count();
        let (lo, hi) = mesh.bounds().unwrap();
        println!("{path}: solids {} tri {} open {open} dup {dup} area {:.6} ({:.6}) vol {:.6} ({:.6}) box {lo:.3} {hi:.3} | {:?} {:?} {:?}",
            model.solids.len(), mesh.triangles.len(), mesh.area(), mass.area, mesh.volume(), mass.volume, t1, t2, t3);
        for w in reporter.warnings() { println!("   {} {}", w.code, w.message); }
    }
}

#[test]
fn scratch_uses() {
    use meltpath_geometry::brep::{Loop, Sense};
    let Ok(list) = std::env::var("STEP_FILES") else { return };
    for path in list.split_whitespace() {
        let bytes = std::fs::read(path).unwrap();
        let Ok(model) = step::parse(&bytes, &Reporter::new()) else { continue };
        for s in &model.solids {
            let mut uses: HashMap<u32, Vec<(bool, bool, u64)>> = HashMap::new();
            for f in &s.solid.faces { for l in &f.loops { if let Loop::Edges(u) = l { for u in u {
                uses.entry(u.edge).or_default().push((u.sense == Sense::Forward, f.sense == Sense::Forward, f.id));
            }}}}
            let mut stat: HashMap<(bool, bool), usize> = HashMap::new();
            for (_, u) in &uses { if u.len() == 2 {
                *stat.entry((u[0].0 == u[1].0, u[0].1 == u[1].1)).or_default() += 1;
            }}
            println!("{path} (same dir, same face sense): {stat:?}");
        }
    }
}
