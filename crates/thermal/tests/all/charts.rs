//! Charts: computed, stored, refused, and compared with the reference solver they come from.
use std::time::Instant;

use crate::support::{slow, slow_and_warm};
use meltpath_base::container::ContainerError;
use meltpath_thermal::charts::file::{ChartFileError, read, write};

/// Time to 2800 °C in steps of 2.5 µs, and B6: size and time of a set.
#[test]
fn ebm_b06_a_set_is_small_and_soon_there() {
    let begun = Instant::now();
    let set = slow();
    let mut bytes = Vec::new();
    write(set, &mut bytes).unwrap();
    println!(
        "B6: {:.1} s, {:.2} MB, {} curves",
        begun.elapsed().as_secs_f64(),
        bytes.len() as f64 / 1e6,
        set.charts.iter().map(|c| c.heating.len()).sum::<usize>()
    );
    assert!(bytes.len() < 10_000_000);
    // 843, 812, 804, 725 steps in the check
    for (chart, check) in set.charts.iter().zip([843.0, 812.0, 804.0, 725.0]) {
        let end = f64::from(*chart.heating[0].times.last().unwrap()) / 2.5e-6;
        println!("M = {:.3}: {end:.0} steps", chart.powder_share);
        assert!((end / check - 1.0).abs() < 0.02, "{end} {check}");
    }
    // whole and unharmed after a round trip
    assert_eq!(read(&mut bytes.as_slice()).unwrap(), *set);
}

/// Histories over warm ground are kept too.
#[test]
fn warm_ground_comes_back_from_a_file() {
    let set = slow_and_warm();
    let mut bytes = Vec::new();
    write(set, &mut bytes).unwrap();
    println!(
        "{} grounds, {:.2} MB",
        set.warm.len(),
        bytes.len() as f64 / 1e6
    );
    assert!(bytes.len() < 10_000_000);
    assert_eq!(read(&mut bytes.as_slice()).unwrap(), *set);
}

#[test]
fn a_damaged_or_foreign_chart_is_refused() {
    let mut bytes = Vec::new();
    write(slow(), &mut bytes).unwrap();
    let cut = read(&mut &bytes[..bytes.len() - 5]).unwrap_err();
    assert!(
        matches!(cut, ChartFileError::Container(ContainerError::Damaged(_))),
        "{cut}"
    );
    let mut harmed = bytes.clone();
    let middle = harmed.len() / 2;
    harmed[middle] ^= 1;
    let harmed = read(&mut harmed.as_slice()).unwrap_err().to_string();
    assert!(harmed.contains("checksum"), "{harmed}");
    let name = b"meltpath-chart/3";
    let at = bytes.windows(16).position(|w| w == name).unwrap();
    for (version, name) in [(b'1', "meltpath-chart/1"), (b'9', "meltpath-chart/9")] {
        bytes[at + 15] = version;
        let foreign = read(&mut bytes.as_slice()).unwrap_err();
        assert!(matches!(&foreign, ChartFileError::Schema { found } if found == name));
    }
}
