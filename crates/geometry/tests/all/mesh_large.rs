//! Ten million triangles in at most 3 GB: reading, examining and slicing. Needs minutes and memory, hence not
//! run by default: `cargo test -p meltpath-geometry --release --test all mesh_large -- --ignored --nocapture`.

use std::io::{BufReader, Read};

use meltpath_base::{Reporter, Silent};
use meltpath_geometry::{
    Plane,
    diagnosis::{DiagnosisOptions, diagnose},
    io::stl::read_stl,
    section::{SlicePlan, slice},
};

/// Segments and rows of a wavy closed tube: 2 × 4 × SEGMENTS × ROWS / 2 triangles with its inside.
const SEGMENTS: u32 = 2500;
const ROWS: u32 = 1000;

/// A binary STL of a double-walled tube, made while it is read.
struct Tube {
    next: u32,
    buffer: Vec<u8>,
}

impl Tube {
    const TRIANGLES: u32 = 4 * SEGMENTS * (ROWS + 1);

    fn point(row: u32, segment: u32) -> [f32; 3] {
        // rows 0..=ROWS go up the outside, the next ROWS + 1 down the inside, and round again
        let row = row % (2 * ROWS + 2);
        let (k, inset) = if row <= ROWS {
            (row, 0.0)
        } else {
            (2 * ROWS + 1 - row, 6.0)
        };
        let angle = f64::from(segment % SEGMENTS) * std::f64::consts::TAU / f64::from(SEGMENTS);
        let t = f64::from(k) / f64::from(ROWS);
        let radius = 100.0 + 5.0 * (9.0 * t).sin() + 2.0 * (5.0 * angle).cos() - inset;
        [
            (radius * angle.cos()) as f32,
            (radius * angle.sin()) as f32,
            (300.0 * t) as f32,
        ]
    }
}

impl Read for Tube {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        while self.buffer.len() < out.len().min(1 << 16) && self.next < Self::TRIANGLES {
            let (quad, half) = (self.next / 2, self.next % 2);
            let (row, segment) = (quad / SEGMENTS, quad % SEGMENTS);
            let [a, b, c, d] = [
                (row, segment),
                (row, segment + 1),
                (row + 1, segment + 1),
                (row + 1, segment),
            ]
            .map(|(r, s)| Self::point(r, s));
            let corners = if half == 0 { [a, b, c] } else { [a, c, d] };
            self.buffer.extend([0; 12]);
            for x in corners.iter().flatten() {
                self.buffer.extend(x.to_le_bytes());
            }
            self.buffer.extend([0; 2]);
            self.next += 1;
        }
        let n = out.len().min(self.buffer.len());
        out[..n].copy_from_slice(&self.buffer[..n]);
        self.buffer.drain(..n);
        Ok(n)
    }
}

/// Peak resident memory, GB, where the system tells it.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kilobytes: f64 = line.split_ascii_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024.0 / 1e9)
}

#[test]
#[ignore = "needs minutes and 2 GB"]
fn ten_million_triangles_fit_in_three_gigabytes() {
    let start = std::time::Instant::now();
    let tell = |what: &str| {
        eprintln!(
            "{what}: {:.1} s, peak {:.2} GB",
            start.elapsed().as_secs_f64(),
            peak().unwrap_or(0.0)
        );
    };
    let mut header = vec![0; 84];
    header[80..].copy_from_slice(&Tube::TRIANGLES.to_le_bytes());
    let file = Tube {
        next: 0,
        buffer: header,
    };
    let length = 84 + 50 * u64::from(Tube::TRIANGLES);
    let reporter = Reporter::new();
    let part = read_stl(
        BufReader::with_capacity(1 << 16, file),
        Some(length),
        &reporter,
        &Silent,
    )
    .unwrap()
    .mesh;
    assert!(part.triangles.len() >= 10_000_000);
    assert_eq!(part.vertices.len(), (SEGMENTS * (2 * ROWS + 2)) as usize);
    tell("read");
    let heights = (0..200).map(|k| 0.75 + 1.5 * f64::from(k)).collect();
    let slices = slice(
        &part,
        &SlicePlan::new(Plane::horizontal(0.0), heights),
        &reporter,
        &Silent,
    )
    .unwrap();
    let volume: f64 = slices.iter().map(|s| s.area() * 1.5).sum();
    tell("sliced");
    let found = diagnose(&part, &DiagnosisOptions::default(), &Silent).unwrap();
    tell("examined");
    assert!(found.is_sound(), "{:?}", found.findings);
    assert!((volume / found.volume - 1.0).abs() < 1e-4);
    if let Some(peak) = peak() {
        assert!(peak < 3.0, "peak memory {peak:.2} GB");
    }
}
