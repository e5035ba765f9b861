//! What people write in TOML: jobs, the data that ships, mappings of records, measurements.

use std::path::Path;

use meltpath::fit::measurements;
use meltpath::{job, measure, records, start};
use meltpath_base::Reporter;
use meltpath_data::{energy, gases, materials, pools, process_maps, recipes, scan_heads, wires};
use meltpath_deposition::consumable::{Gas, PoolFile, Wire, nearest_pool};
use meltpath_deposition::energy::EnergyFile;
use meltpath_deposition::process_map::ProcessMap;
use meltpath_perception::Mapping;
use meltpath_scan_head::files::{parse_head, parse_recipe};
use meltpath_thermal::material::file::{self as material_file, Readings};

use super::{Target, files, in_file, shipped, text, with_text};

/// Jobs of the three processes.
pub(super) const JOB: Target = text(
    "job",
    || {
        let mut seeds: Vec<Vec<u8>> = [
            start::WAAM_TEMPLATE,
            start::EBM_TEMPLATE,
            start::LPBF_TEMPLATE,
        ]
        .map(|t| t.as_bytes().to_vec())
        .to_vec();
        for example in [
            "bracket",
            "ebm-triangle",
            "scan-head-layers",
            "boss-on-pipe",
        ] {
            seeds.extend(files(&format!("examples/{example}"), &["toml"], 1 << 16));
        }
        seeds
    },
    |bytes| {
        with_text(bytes, |text| {
            for problem in job::parse(text).err().unwrap_or_default() {
                if let Some(span) = problem.span {
                    let inside = text.get(span).is_some();
                    assert!(inside, "a place outside the file: {}", problem.message);
                }
            }
        });
    },
);

/// Wires.
pub(super) const WIRE: Target = text(
    "wire",
    || shipped(wires::ALL),
    |bytes| {
        with_text(bytes, |text| {
            if let Ok(wire) = Wire::parse(text) {
                assert!(wire.section() > 0.0);
            }
        });
    },
);

/// Shielding gases.
pub(super) const GAS: Target = text(
    "gas",
    || shipped(gases::ALL),
    |bytes| {
        with_text(bytes, |text| {
            let _ = Gas::parse(text);
        });
    },
);

/// Measured pools: the nearest to any setting is one of the file's.
pub(super) const POOL: Target = text(
    "pool",
    || shipped(pools::ALL),
    |bytes| {
        with_text(bytes, |text| {
            if let Ok(file) = PoolFile::parse(text) {
                for (wire_feed, travel_speed) in [(9.0, 0.5), (1e-9, 1e9)] {
                    let pool = nearest_pool(&file.pool, wire_feed, travel_speed);
                    assert!(pool.is_some(), "a file of no pool");
                }
            }
        });
    },
);

/// Energies per volume.
pub(super) const ENERGY: Target = text(
    "energy",
    || shipped(energy::ALL),
    |bytes| {
        with_text(bytes, |text| {
            if let Ok(file) = EnergyFile::parse(text)
                && let Some(energy) = file.of("x90-ig-1.0", "cmt", "m14")
            {
                let sound = energy.mean > 0.0 && energy.sigma >= 0.0;
                assert!(sound, "an energy of {} ± {}", energy.mean, energy.sigma);
            }
        });
    },
);

/// Process maps, and a bead of those that read.
pub(super) const PROCESS_MAP: Target = text(
    "process_map",
    || {
        let mut seeds = shipped(process_maps::ALL);
        // a measured map; the one that ships is a law
        seeds.extend(files("crates/deposition/tests/data", &["toml"], 1 << 16));
        seeds
    },
    |bytes| {
        with_text(bytes, |text| {
            let wire = Wire::builtin("x90-ig-1.0").unwrap();
            if let Ok(map) = ProcessMap::parse("fuzz", text, &wire, &Reporter::new()) {
                let bead = map.bead(8.0 * 1000.0 / 60.0, 0.75 * 1000.0 / 60.0);
                assert!(
                    bead.width.value.is_nan() || bead.width.value >= 0.0,
                    "a bead of negative width"
                );
            }
        });
    },
);

/// Materials of heat.
pub(super) const MATERIAL: Target = text(
    "material",
    || shipped(materials::ALL),
    |bytes| {
        in_file(bytes, ".toml", |path| {
            let _ = meltpath::material::load(
                &path.to_string_lossy(),
                Readings::default(),
                Path::new("."),
            );
            let _ = std::fs::read_to_string(path).map(|text| material_file::sources(&text));
        });
    },
);

/// Scan heads.
pub(super) const SCAN_HEAD: Target = text(
    "scan_head",
    || shipped(scan_heads::ALL),
    |bytes| {
        with_text(bytes, |text| {
            if let Ok(data) = parse_head(text) {
                let _ = data.head.ready();
            }
        });
    },
);

/// Recipes of scan jobs.
pub(super) const RECIPE: Target = text(
    "recipe",
    || shipped(recipes::ALL),
    |bytes| {
        with_text(bytes, |text| {
            let _ = parse_recipe(text);
        });
    },
);

/// Mappings of records.
pub(super) const MAPPING: Target = text(
    "mapping",
    || {
        vec![
            b"sample_time = \"50 us\"\nrows = [1, 200]\n[channels.voltage]\ncolumn = \"U\"\nunit = \"V\"\n[channels.angle]\ncolumn = 2\n\
            unit = \"deg\"\nscale = 6.87e-5\noffset = 12.0\n"
                .to_vec(),
            b"time = { column = \"t\", unit = \"s\" }\n[channels.current]\ncolumn = \"I\"\nunit = \"mA\"\n".to_vec(),
        ]
    },
    |bytes| {
        with_text(bytes, |text| {
            let _ = Mapping::parse("fuzz.toml", text);
        });
    },
);

/// What `meltpath measure` reads of a scan, corners included.
pub(super) const SCAN_FILE: Target = text(
    "scan_file",
    || {
        vec![
            b"scan = \"plate.ply\"\nwire = \"g3si-1.2\"\ngas = \"m21\"\nmode = \"cmt\"\n[[bead]]\nwire_feed = \"5 m/min\"\n\
            travel_speed = \"0.4 m/min\"\nmeasured_feed = \"5.2 m/min\"\n"
                .to_vec(),
            b"scan = \"plate.xyz\"\nunit = \"in\"\nnear = \"0.1 mm\"\nevery = \"2 mm\"\n[[bead]]\nwire_feed = \"5 m/min\"\n\
            travel_speed = \"0.4 m/min\"\ncorner = \"-135 deg\"\n"
                .to_vec(),
        ]
    },
    |bytes| {
        in_file(bytes, ".toml", |path| {
            if let Ok(scan) = measure::read_file(path) {
                assert!(scan.near > 0.0 && scan.every > 0.0 && scan.unit > 0.0);
                assert!(scan.corners.iter().all(|c| c.turn.is_finite()));
            }
        });
    },
);

/// What `meltpath measure` reads of records of a deposit.
pub(super) const RECORDS_FILE: Target = text(
    "records_file",
    || {
        let head = "wire = \"er70s-6-0.9\"\ngas = \"m21\"\nmode = \"cmt\"\nmap = \"er70s-6-0.9-cmt-m21\"\nstabiliser = \"2 m/min\"\n";
        let columns = "[columns]\ntime = \"t\"\nvoltage = \"U\"\ncurrent = { column = \"shunt\", unit = \"A\", scale = -1.0 }\nfeed = \"wire feed\"\n";
        let record = "[[record]]\nfile = \"layer-01.csv\"\nwire_feed = \"6 m/min\"\ntravel_speed = \"0.6 m/min\"\n";
        let by_layers =
            "first_distance = \"15 mm\"\nlayer_height = \"1.2 mm\"\ngrowth = \"1.6 mm\"\n";
        vec![
            format!("{head}{columns}{record}distance = \"15 mm\"\n").into_bytes(),
            format!("{head}{by_layers}{columns}{record}layer = 6\n").into_bytes(),
        ]
    },
    |bytes| {
        in_file(bytes, ".toml", |path| {
            let _ = records::read_file(path);
        });
    },
);

/// Measured bodies of a fit.
pub(super) const MEASUREMENTS: Target = text(
    "measurements",
    || files("examples/ebm-struts", &["toml"], 1 << 16),
    |bytes| {
        in_file(bytes, ".toml", |path| {
            let _ = measurements::read(path);
        });
    },
);
