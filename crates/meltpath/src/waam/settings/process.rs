//! What a wire-arc job is deposited with: wire, gas, process map, weld pools, energies, each found by its name or by its file.

use std::path::Path;

use meltpath_base::settings::{Problem, Problems};
use meltpath_base::{Pure, Reporter};
use meltpath_data::{File, energy, gases, pools, process_maps, wires};
use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
use meltpath_deposition::consumable::{Gas, PoolFile, PoolRow, Wire, nearest_pool};
use meltpath_deposition::energy::{EnergyFile, EnergyPerVolume};
use meltpath_deposition::process_map::{Bead, ProcessMap, ProcessMapError};

use crate::data::{DataFileError, DataText, known};
use crate::job::waam::WaamTable;

/// What the metal is and how it comes.
pub(in crate::waam) struct Process {
    /// The wire.
    pub(in crate::waam) wire: Wire,
    /// The gas.
    pub(in crate::waam) gas: Gas,
    /// The process map.
    pub(in crate::waam) map: ProcessMap,
    /// Electric energy per volume of deposit, where it was measured.
    pub(in crate::waam) energy: Option<EnergyPerVolume>,
    /// The weld pools.
    pub(in crate::waam) pools: Vec<PoolRow>,
    /// The file of another wire from which the pools are.
    pub(in crate::waam) borrowed: Option<String>,
    /// The files that are the user's own.
    pub(in crate::waam) own: Vec<DataText>,
}

/// Wire, gas, process map, pools and energies: everything wrong with any of them is told.
pub(in crate::waam) fn load(
    waam: &WaamTable,
    folder: &Path,
    reporter: &Reporter,
) -> Result<Process, Vec<Problem>> {
    let mut own = Vec::new();
    let mut read = |what, name: &str, shipped: &'static [File]| {
        let text = DataText::load(what, name, shipped, folder)?;
        text.warn(shipped, reporter);
        if text.file.is_some() {
            own.push(text.clone());
        }
        Ok::<_, DataFileError>(text)
    };
    let wire = read("wire", &waam.wire, wires::ALL).and_then(|text| text.read(Wire::parse));
    let gas = read("gas", &waam.gas, gases::ALL).and_then(|text| text.read(Gas::parse));
    let (wire, gas) = match (wire, gas) {
        (Ok(wire), Ok(gas)) => (wire, gas),
        (wire, gas) => {
            let mut problems = Vec::new();
            problems.extend(wire.err().map(|e| e.at(&waam.wire)).into_iter().flatten());
            problems.extend(gas.err().map(|e| e.at(&waam.gas)).into_iter().flatten());
            return Err(problems);
        }
    };
    let id = format!("{}-{}-{}", *wire.id, *waam.mode, *gas.id);
    let map = read(
        "process map",
        waam.map.as_ref().unwrap_or(&id),
        process_maps::ALL,
    );
    let map = match (map, &*waam.map) {
        (Ok(text), _) => process_map(waam, &text, &wire, &gas, reporter)?,
        (Err(error), Some(_)) => return Err(error.at(&waam.map)),
        (Err(error), None) => {
            let help =
                "measure a map for this wire, mode and gas, and name it: map = \"my-map.toml\"";
            return Err(vec![waam.mode.problem(error.to_string()).help(help)]);
        }
    };
    let named = match &*waam.pool {
        Some(name) => Some(read("weld pool", name, pools::ALL).map_err(|e| e.at(&waam.pool))?),
        None => None,
    };
    let (pool, borrowed) = pools_of(waam, named, folder, [&wire.id, &gas.id], reporter)?;
    if named_by_itself(waam, &pool) {
        own.push(pool.clone());
    }
    let named = match &*waam.energy {
        Some(name) => vec![
            DataText::load("energy", name, energy::ALL, folder).map_err(|e| e.at(&waam.energy))?,
        ],
        None => known(energy::ALL, folder),
    };
    let mut found = None;
    for text in named {
        let file = text
            .read(EnergyFile::parse)
            .map_err(|e| e.at(&waam.energy))?;
        found = file.of(&wire.id, &waam.mode, &gas.id);
        if found.is_some() {
            if text.file.is_some() {
                own.push(text);
            }
            break;
        }
    }
    Ok(Process {
        map: adjusted(map, waam),
        energy: found,
        pools: pool
            .read(PoolFile::parse)
            .map_err(|e| e.at(&waam.pool))?
            .pool
            .value,
        borrowed,
        wire,
        gas,
        own,
    })
}

/// Whether a pool is the user's own and was not read by its name already.
fn named_by_itself(waam: &WaamTable, pool: &DataText) -> bool {
    waam.pool.is_none() && pool.file.is_some()
}

/// The map of a text, for the wire, the gas and the mode of the job.
fn process_map(
    waam: &WaamTable,
    text: &DataText,
    wire: &Wire,
    gas: &Gas,
    reporter: &Reporter,
) -> Result<ProcessMap, Vec<Problem>> {
    let name = text.name.clone();
    let map = text
        .read(|text| {
            ProcessMap::parse(&name, text, wire, reporter).map_err(|e| match e {
                ProcessMapError::Content(problems) => problems,
                other => Problems::from(Problem::new(other.to_string())),
            })
        })
        .map_err(|e| e.at(&waam.map))?;
    for assumed in &map.assumed {
        reporter.warn(
            "map-assumes",
            format!("the process map {} assumes {assumed}", map.id),
            "measure beads of your own for a process map of your own",
        );
    }
    let mut problems = Vec::new();
    for (what, of_map, of_job) in [
        ("wire", &map.wire, &wire.id.value),
        ("gas", &map.gas, &gas.id.value),
        ("mode", &map.mode, &waam.mode.value),
    ] {
        if of_map != of_job {
            let message =
                format!("the process map is for {what} \"{of_map}\", the job for \"{of_job}\"");
            problems.push(waam.map.problem(message).help(
                "name a map measured with what the job uses, or use what the map was measured with",
            ));
        }
    }
    if problems.is_empty() {
        Ok(map)
    } else {
        Err(problems)
    }
}

/// The map with what the job knows better.
fn adjusted(mut map: ProcessMap, waam: &WaamTable) -> ProcessMap {
    if let Some(efficiency) = *waam.efficiency {
        map.efficiency.value = Pure(efficiency.0);
        "the job".clone_into(&mut map.efficiency.source);
    }
    match *waam.source.feed_factor {
        Some(factor) => map.with_feed_factor(factor.0),
        None => map,
    }
}

/// The pools that the job names, else those of its wire, mode and gas, else those of the nearest configuration that was measured,
/// said so; with the name of that one where it is of another wire.
fn pools_of(
    waam: &WaamTable,
    named: Option<DataText>,
    folder: &Path,
    [wire, gas]: [&str; 2],
    reporter: &Reporter,
) -> Result<(DataText, Option<String>), Vec<Problem>> {
    let all = match named {
        Some(named) => vec![named],
        None => known(pools::ALL, folder),
    };
    let mut best: Option<([bool; 3], DataText, String)> = None;
    for text in all {
        let file = text.read(PoolFile::parse).map_err(|e| e.at(&waam.pool))?;
        let same = [
            *file.wire == wire,
            *file.mode == *waam.mode,
            *file.gas == gas,
        ];
        if best.as_ref().is_none_or(|(found, ..)| same > *found) {
            best = Some((same, text, file.id.value));
        }
    }
    let Some((same, text, id)) = best else {
        return Err(vec![waam.pool.problem("no weld pool is known")]);
    };
    if same != [true; 3] {
        reporter.warn(
            "pool-borrowed",
            format!(
                "no weld pool was measured for {wire}, {}, {gas}: that of {id} is scaled to the bead",
                *waam.mode
            ),
            "measure the pool by camera, and name it: pool = \"my-pool.toml\"",
        );
    }
    Ok((text, (!same[0]).then_some(id)))
}

/// The measured pool nearest to the bead's settings, scaled to it.
pub(in crate::waam) fn pool(pools: &[PoolRow], bead: &Bead, model: &BeadModel) -> PoolModel {
    match nearest_pool(pools, bead.wire_feed, bead.travel_speed) {
        Some(row) => PoolModel::for_bead(&row.model(PursuitLength::ByCorner), model),
        // without any measured pool: round, centred under the wire
        None => PoolModel {
            front: 0.5 * model.width,
            rear: 0.5 * model.width,
            half_width: 0.5 * model.width,
            offset: 0.0,
            pursuit: PursuitLength::ByCorner,
        },
    }
}
