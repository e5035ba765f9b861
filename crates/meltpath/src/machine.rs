//! The machine that a command runs on: how much it can hold, and how much it does at once.

use std::path::Path;

/// Memory where the system does not say how much there is, bytes.
const UNKNOWN: f64 = 64e9;

/// What a machine has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Machine {
    /// Memory that a process may have, bytes.
    pub(crate) bytes: f64,
    /// Threads that work at once.
    pub(crate) cores: usize,
}

impl Machine {
    /// This one.
    pub(crate) fn here() -> Self {
        let all = read("/proc/meminfo").and_then(|text| installed(&text));
        // a container may have less than its machine
        let groups = [
            "/sys/fs/cgroup/memory.max",
            "/sys/fs/cgroup/memory/memory.limit_in_bytes",
        ];
        let groups = groups
            .iter()
            .filter_map(|file| read(file)?.trim().parse::<f64>().ok());
        let least = groups
            .chain(all)
            .filter(|b| *b > 0.0)
            .fold(f64::INFINITY, f64::min);
        Machine {
            bytes: if least.is_finite() { least } else { UNKNOWN },
            cores: rayon::current_num_threads(),
        }
    }
}

fn read(file: &str) -> Option<String> {
    std::fs::read_to_string(Path::new(file)).ok()
}

/// Bytes of memory by Linux' own table.
fn installed(table: &str) -> Option<f64> {
    let line = table.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kilobytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_from_the_systems_table() {
        let table = "MemTotal:       24561234 kB\nMemFree:         1234 kB\n";
        assert_eq!(installed(table), Some(1024.0 * 24_561_234.0));
        assert_eq!(installed("MemFree: 12 kB\n"), None);
        let here = Machine::here();
        assert!(here.bytes > 1e8 && here.cores > 0);
    }
}
