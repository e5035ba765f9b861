//! What a wire-arc job is deposited with: wire, gas, process map, weld pools, energies, each found by its name or by its file.

use std::path::Path;

use meltpath_base::settings::{Problem, Problems, Setting};
use meltpath_base::{Pure, Reporter};
use meltpath_data::{File, energy, gases, pools, process_maps, wires};
use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
use meltpath_deposition::consumable::{Gas, PoolFile, PoolRow, Wire, nearest_pool};
use meltpath_deposition::energy::{EnergyFile, EnergyPerVolume};
use meltpath_deposition::process_map::{Bead, ProcessMap, ProcessMapError};
use meltpath_deposition::pursuit::law::PursuitLaw;

use crate::data::{DataFileError, DataText, known};
use crate::job::waam::WaamTable;
use crate::pools::{Nearest, nearest};

/// What of the bead is known from another wire alone: the files.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Borrowed {
    /// That of the weld pools.
    pub pool: Option<String>,
    /// That of the pursuit lengths.
    pub pursuit: Option<String>,
}

/// What the metal is and how it comes.
pub(in crate::waam) struct Process {
    /// The wire.
    pub(in crate::waam) wire: Wire,
    /// The gas.
    pub(in crate::waam) gas: Gas,
    /// The process map.
    pub(in crate::waam) map: ProcessMap,
    /// Electric energy per volume of wire fed, where it was measured.
    pub(in crate::waam) energy: Option<EnergyPerVolume>,
    /// The weld pools.
    pub(in crate::waam) pools: Vec<PoolRow>,
    /// How far the bead stays behind the torch at corners.
    pub(in crate::waam) pursuit: PursuitLaw,
    /// The file that tells it.
    pub(in crate::waam) law: String,
    /// What is of another wire.
    pub(in crate::waam) borrowed: Borrowed,
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
    let laying = laying(waam, folder, [&wire.id, &gas.id], reporter)?;
    own.extend(laying.own);
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
        pools: laying.pools,
        pursuit: laying.pursuit,
        law: laying.law,
        borrowed: laying.borrowed,
        wire,
        gas,
        own,
    })
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

/// What lays the bead: its weld pools, how far it stays behind the torch at corners, and the files of either.
struct Laying {
    pools: Vec<PoolRow>,
    pursuit: PursuitLaw,
    /// The file of the pursuit lengths.
    law: String,
    borrowed: Borrowed,
    own: Vec<DataText>,
}

/// The pools and the pursuit lengths that the job names, else those of its wire, mode and gas, else those of the nearest configuration
/// that was measured, said so. A pool file that is named and tells pursuit lengths tells them for the job.
fn laying(
    waam: &WaamTable,
    folder: &Path,
    [wire, gas]: [&str; 2],
    reporter: &Reporter,
) -> Result<Laying, Vec<Problem>> {
    let ids = [wire, waam.mode.as_str(), gas];
    let named = |key: &Setting<Option<String>>| match &key.value {
        Some(name) => {
            let text = DataText::load("weld pool", name, pools::ALL, folder);
            let text = text.map_err(|e| e.at(key))?;
            text.warn(pools::ALL, reporter);
            Ok::<_, Vec<Problem>>(Some(text))
        }
        None => Ok(None),
    };
    let [pool, pursuit] = [named(&waam.pool)?, named(&waam.pursuit)?];
    let pools = nearest(pool.as_ref(), folder, ids, |f| !f.pool.is_empty());
    let Some(pools) = pools.map_err(|e| e.at(&waam.pool))? else {
        let help = "add a table [[pool]] to it, or name a file of pursuit lengths as waam.pursuit";
        let none = waam
            .pool
            .problem("no weld pool is known, or the file named tells none");
        return Err(vec![none.help(help)]);
    };
    let tells = |f: &PoolFile| f.law().is_some();
    let of_pool = pool.as_ref().filter(|_| tells(&pools.file));
    let law = nearest(pursuit.as_ref().or(of_pool), folder, ids, tells);
    let law = law.map_err(|e| e.at(&waam.pursuit))?;
    let Some((law, pursuit)) = law.and_then(|l| l.file.law().map(|pursuit| (l, pursuit))) else {
        let none = "no pursuit length is known, or the file named tells none";
        let help = "add a table [[pursuit]] with corner and length to it";
        return Err(vec![waam.pursuit.problem(none).help(help)]);
    };
    warn_of_borrowed(&pools, &law, ids, reporter);
    let mut own = vec![pools.text.clone(), law.text.clone()];
    own.dedup();
    own.retain(|text| text.file.is_some());
    Ok(Laying {
        borrowed: Borrowed {
            pool: pools.of_another_wire(),
            pursuit: law.of_another_wire(),
        },
        pools: pools.file.pool.value,
        pursuit,
        law: law.file.id.value,
        own,
    })
}

/// Tells what is not of this wire, mode and gas.
fn warn_of_borrowed(
    pools: &Nearest,
    law: &Nearest,
    [wire, mode, gas]: [&str; 3],
    reporter: &Reporter,
) {
    if pools.same != [true; 3] {
        reporter.warn(
            "pool-borrowed",
            format!(
                "no weld pool was measured for {wire}, {mode}, {gas}: that of {} is scaled to the bead",
                *pools.file.id
            ),
            "measure the pool by camera, and name it: pool = \"my-pool.toml\"",
        );
    }
    if law.same != [true; 3] {
        reporter.warn(
            "pursuit-borrowed",
            format!(
                "how far the bead stays behind the torch at corners was not measured for {wire}, {mode}, {gas}: the lengths of {} stand in",
                *law.file.id
            ),
            "scan beads with corners (`meltpath measure`), and name the file that it writes: pursuit = \"pursuit.toml\"",
        );
    }
}

/// The measured pool nearest to the bead's settings, scaled to it.
pub(in crate::waam) fn pool(
    pools: &[PoolRow],
    pursuit: PursuitLaw,
    bead: &Bead,
    model: &BeadModel,
) -> PoolModel {
    let pursuit = PursuitLength::ByCorner(pursuit);
    match nearest_pool(pools, bead.wire_feed, bead.travel_speed) {
        Some(row) => PoolModel::for_bead(&row.model(pursuit), model),
        // without any measured pool: round, centred under the wire
        None => PoolModel {
            front: 0.5 * model.width,
            rear: 0.5 * model.width,
            half_width: 0.5 * model.width,
            offset: 0.0,
            pursuit,
        },
    }
}
