//! Every value of a wire-arc job resolved: what was written, the stated defaults, what the process map says.

pub(crate) mod bead;
mod fill;
pub mod holder;
pub(crate) mod machine;
pub(crate) mod named;
pub(crate) mod process;
pub(crate) mod sound;
pub(crate) mod woven;

use std::path::{Path, PathBuf};

use meltpath_base::quantity::Auto;
use meltpath_base::settings::{Problem, Setting};
use meltpath_base::{Angle, Length, Origin, Provenance, Ratio, Reporter, Resolved, Speed};
use meltpath_deposition::bead::{BeadModel, PoolModel};
use meltpath_deposition::consumable::{Gas, Wire};
use meltpath_deposition::deposit;
use meltpath_deposition::energy::{EnergyBasis, EnergyPerVolume};
use meltpath_deposition::process_map::{Bead, Law, ProcessMap, Tried};
use meltpath_deposition::stepover::fusion_at_risk;
use meltpath_geometry::math::DVec3;
use meltpath_planning::FillSettings;
use meltpath_programs::{BuildError, Dialect, check_axes, check_cell};
use meltpath_robot::cell as robot;
use meltpath_robot::controller::Controller;
use meltpath_toolpath::Weave;

use self::bead::{datum, feed_response, with_unit};
use self::machine::{Machine, nominal_distance, wire_length};
pub use self::process::Borrowed;
use self::process::Process;
use self::sound::sound;
use super::judge::{GrowthError, Limits, Remedies};
use super::maker::reads;
use super::surface;
use crate::data::{Cell, DataText};
use crate::job::common::ToolpathForm;
use crate::job::waam::{
    BeadTable, ChecksTable, ExternalChoice, LayerHeights, LayerRelease, MachineTable, WaamTable,
};
use crate::job::{PartUnit, Problems, WaamJob, Written};
use holder::Holder;

/// A job with every value resolved.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The part file.
    pub part: PathBuf,
    /// Its unit, where it carries none.
    pub part_unit: PartUnit,
    /// The direction of the part file that points up.
    pub up: DVec3,
    /// The wire.
    pub wire: Wire,
    /// The gas.
    pub gas: Gas,
    /// Transfer mode.
    pub mode: String,
    /// Electric energy per volume of wire fed, where it was measured for the mode.
    pub energy: Option<EnergyPerVolume>,
    /// The process map.
    pub map: ProcessMap,
    /// The single bead on a plate; the woven one where beads are woven.
    pub bead: Bead,
    /// How the torch swings about its path in beads.
    pub weave: Option<Weave>,
    /// The bead as the deposit takes it.
    pub bead_model: BeadModel,
    /// The pool that lays it.
    pub pool: PoolModel,
    /// What of another wire stands in for what was not measured of this one.
    pub borrowed: Borrowed,
    /// Data files of the user's own.
    pub own: Vec<DataText>,
    /// How metal is laid.
    pub deposit: deposit::Settings,
    /// Stepover asked for, mm.
    pub stepover: Resolved<f64>,
    /// How layers are filled.
    pub fill: FillSettings,
    /// Layer heights, or the growth model.
    pub heights: Auto<LayerHeights>,
    /// Build only so many layers.
    pub count: Option<u32>,
    /// Pause after each layer, s.
    pub pause: f64,
    /// When the next layer begins.
    pub until: LayerRelease,
    /// The cell.
    pub cell: Cell,
    /// How the cell's controller interpolates; one that holds its speed where the cell does not say.
    pub controller: Controller,
    /// Its name.
    pub cell_name: String,
    /// The robot with what stands around it, where the job names one.
    pub robot: Option<robot::Cell>,
    /// What track and positioner do.
    pub external: ExternalChoice,
    /// Smoothing at via points, 0 to 1.
    pub smoothing: f64,
    /// Contact tube to work distance at the first layer, mm.
    pub ctwd: f64,
    /// Plate: length and width, where given, mm.
    pub plate: Option<[f64; 2]>,
    /// Height of the plate in the user frame of a program that other software wrote, where it is told, mm.
    pub plate_height: Option<f64>,
    /// Thickness of the plate, mm; zero where the part stands on none.
    pub plate_thickness: f64,
    /// What holds the part beside the table, in the coordinates of the part file, mm.
    pub holders: Vec<Holder>,
    /// Metal beyond the finished part's sides, mm.
    pub allowance: f64,
    /// Metal over faces that look up, where the job says it, mm.
    pub allowance_top: Option<f64>,
    /// Limits of the verdict.
    pub limits: Limits,
    /// What to do about checks that fail.
    pub remedies: Remedies,
    /// Dialects of the programs that a run writes.
    pub programs: Vec<Dialect>,
    /// Whether a run writes its plan for other software, too, and in which form.
    pub toolpath: Option<ToolpathForm>,
    /// Layers that are not flat, where the job asks for them.
    pub surface: Option<surface::Asked>,
    /// Cell of the height map, mm.
    pub cell_size: f64,
    /// Chord error of the mesh made of a B-rep, mm.
    pub chord_error: f64,
    /// Every value with its origin.
    pub provenance: Provenance,
}

/// Resolves a job whose file lies in `folder`.
///
/// # Errors
/// Everything wrong, with its place in the job.
pub fn resolve(
    job: &Written<WaamJob>,
    folder: &Path,
    reporter: &Reporter,
) -> Result<Settings, Problems> {
    let mut r = job.provenance.clone();
    let (waam, machine) = (&job.waam, &job.machine);
    let process = process::load(waam, folder, reporter);
    let moved = machine::load(machine, folder, reporter, &mut r);
    let (mut process, Machine { cell, robot, own }) = match (process, moved) {
        (Ok(process), Ok(moved)) => (process, moved),
        (process, moved) => {
            let mut found = process.err().unwrap_or_default();
            found.extend(moved.err().unwrap_or_default());
            return Err(found.into());
        }
    };
    process.own.extend(own);
    tell_process(waam, &process, &mut r);
    let Process {
        wire,
        gas,
        map,
        energy,
        pools,
        pursuit,
        borrowed,
        own,
        ..
    } = process;
    let programs = programs(job, robot.as_ref(), &cell);
    let sound = sound(job, &map, programs)?;
    let (plain, step, woven) = (sound.bead, sound.step, sound.woven);
    map.warn_about(&plain, reporter);
    tell_bead(&waam.bead, &plain, &map.id, &mut r);
    // metal is laid along the woven path by the pool of the bead that is not woven
    let bead_model = plain.model(&map);
    let feed_response = feed_response(&mut r, &waam.source, &map, plain.wire_feed, reporter);
    let pool = process::pool(&pools, pursuit, &plain, &bead_model);
    let told = (reporter, &mut r);
    woven::tell(&waam.bead.weave, woven.as_ref(), cell.motion.as_ref(), told)?;
    let bead = woven.map_or(plain, |w| w.bead);
    let width = bead.width.value;
    let stepover = Resolved::new(Length(step.value), step.origin.clone());
    r.value(&job.fill.stepover.name, stepover);
    warn_of_feet(&bead, step.value / width, reporter);
    let controller = controller(&cell);
    let fill = fill::filled(job, (&bead, step.value), &map, &mut r)?;
    let nominal = Length(nominal_distance(&cell));
    let ctwd = machine.ctwd.or_computed(&mut r, nominal).0;
    let robot = robot.map(|mut robot| {
        wire_length(&mut robot, ctwd, reporter);
        robot
    });
    let surface = surface::asked(job, folder, (&bead, step.value), &mut r);
    check_distance(&job.checks, &machine.ctwd, ctwd)?;
    let limits = limits(&job.checks, ctwd, &mut r);
    models(&cell, &map, &mut r);
    Ok(Settings {
        part: folder.join(&**job.part),
        part_unit: *job.part_unit,
        up: DVec3::from_array(job.build_direction.0),
        wire,
        gas,
        mode: waam.mode.value.clone(),
        energy,
        bead,
        weave: woven.map(|w| w.weave),
        bead_model,
        pool,
        borrowed,
        own,
        deposit: deposit::Settings {
            nominal_ctwd: ctwd,
            feed_response,
            ..deposit::Settings::default()
        },
        map,
        stepover: step,
        fill,
        heights: job.layers.height.value.clone(),
        count: *job.layers.count,
        pause: job.layers.pause.0,
        until: *job.layers.until,
        controller,
        cell,
        cell_name: machine.cell.value.clone(),
        robot,
        external: *machine.external,
        smoothing: machine.smoothing.0,
        ctwd,
        plate: job.substrate.size.map(|s| s.map(|l| l.0)),
        plate_height: job.substrate.height.map(|h| h.0),
        plate_thickness: plate_thickness(job),
        holders: holders(&job.machine),
        allowance: job.target.allowance.0,
        allowance_top: job.target.allowance_top.map(|top| top.0),
        limits,
        remedies: Remedies::of(&job.layers.height, *job.fill.starts),
        programs: sound.programs,
        toolpath: *job.output.toolpath,
        surface,
        cell_size: job.simulation.cell.0,
        chord_error: job.simulation.chord_error.0,
        provenance: r,
    })
}

/// How thick the plate under the part is, mm. A body that is there already, and a cylinder or body of revolution that a wall begins on, are
/// clamped by themselves unless the job says otherwise.
fn plate_thickness(job: &WaamJob) -> f64 {
    let round = job
        .surface
        .as_ref()
        .is_some_and(|s| s.base.radius.is_some() || s.base.profile.is_some());
    let clamped = job.onto.is_some() || round;
    if clamped && !job.substrate.is_written() {
        0.0
    } else {
        job.substrate.thickness.0
    }
}

/// What holds the part beside the table, as the job writes it.
fn holders(machine: &MachineTable) -> Vec<Holder> {
    let place = |p: &[Length; 3]| DVec3::from_array(p.map(|l| l.0));
    let rods = machine.holders.iter().map(|h| Holder {
        ends: [place(&h.from), place(&h.to)],
        radius: h.radius.0,
    });
    rods.collect()
}

/// The dialects of the programs that the job asks for, which can say what moves.
fn programs(
    job: &WaamJob,
    robot: Option<&robot::Cell>,
    cell: &Cell,
) -> Result<Vec<Dialect>, Problem> {
    let programs = job.output.programs.value.clone();
    let programs = programs.unwrap_or_else(|| vec![*cell.program.dialect]);
    machine::check_external(&job.machine, robot, cell, &programs)?;
    if job.output.toolpath.is_some() && job.waam.bead.weave.is_some() {
        let toolpath = &job.output.toolpath;
        let what = "the beads are woven, and a 3MF toolpath has no words for a weave";
        return Err(toolpath
            .problem(what)
            .help("leave out output.toolpath, or plan without waam.bead.weave"));
    }
    Ok(programs)
}

/// Warns where flat beads lie so far apart that they may not fuse.
fn warn_of_feet(bead: &Bead, widths: f64, reporter: &Reporter) {
    let ratio = bead.wire_feed / bead.travel_speed;
    if fusion_at_risk(ratio, widths) {
        reporter.warn(
            "stepover-fusion",
            format!("flat beads (ratio of wire feed to travel speed {ratio:.1}) {widths:.2} widths apart may not fuse at their feet"),
            "set fill.stepover to \"0.70 w\" or less",
        );
    }
}

/// The laws that were tried on measured beads with their errors, the one that is taken first; none where the law is given.
pub(super) fn laws_tried(map: &ProcessMap) -> Option<String> {
    let percent = |e: f64| format!("{:.1} %", 100.0 * e);
    let told = |t: &Tried| {
        let [width, height] = t.left_out.map(percent);
        format!("{}: width {width}, height {height}", t.form)
    };
    let all: Vec<String> = map.tried.iter().map(told).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// Records what the process map says where the job says nothing.
fn tell_process(waam: &WaamTable, process: &Process, r: &mut Provenance) {
    let Process { wire, map, .. } = process;
    let origin = || Origin::Data(format!("process map {}", map.id));
    r.value(&waam.map.name, Resolved::new(map.id.clone(), origin()));
    if let Some(tried) = laws_tried(map) {
        let words = "errors of beads left out, root mean square; the first is taken";
        let origin = Origin::Computed(words.to_owned());
        r.value("waam.map.law", Resolved::new(tried, origin));
    }
    let knot = |[corner, length]: &[f64; 2]| format!("{}: {}", Angle(*corner), Length(*length));
    let lengths: Vec<String> = process.pursuit.knots().iter().map(knot).collect();
    let origin = Origin::Data(format!("pursuit lengths of {}", process.law));
    r.value(
        &waam.pursuit.name,
        Resolved::new(lengths.join("; "), origin),
    );
    for text in &process.own {
        r.model(&format!("{} {}", text.kind, text.name), &text.origin());
    }
    if let Some(energy) = &process.energy {
        let beads = match energy.basis {
            EnergyBasis::Configuration => "beads of this wire, mode and gas",
            EnergyBasis::OtherGases => "beads of this wire and mode with other gases",
        };
        let energy = Resolved {
            value: energy.mean,
            origin: Origin::Data(format!("{}: {beads}", energy.source)),
            sigma: Some(energy.sigma),
        };
        r.value("waam.energy_per_volume", with_unit(energy, "J/mm³"));
    }
    for (key, of_map) in [
        (&waam.efficiency, &map.efficiency),
        (&waam.source.feed_factor, &map.feed_factor),
    ] {
        if !key.is_written() {
            r.value(&key.name, datum(of_map, Ratio));
        }
    }
    r.value("waam.wire_diameter", datum(&wire.diameter, Length));
}

/// Records the bead: what is written, and what the process map makes of it, with its uncertainty.
fn tell_bead(table: &BeadTable, bead: &Bead, map: &str, r: &mut Provenance) {
    let origin = |written: bool| {
        if written {
            Origin::Job
        } else {
            Origin::Computed(format!("process map {map}"))
        }
    };
    for (key, speed) in [
        (&table.wire_feed, bead.wire_feed),
        (&table.travel_speed, bead.travel_speed),
    ] {
        r.value(
            &key.name,
            Resolved::new(Speed(speed), origin(key.is_written())),
        );
    }
    for (key, size) in [(&table.width, &bead.width), (&table.height, &bead.height)] {
        let length = Resolved::new(Length(size.value), origin(key.is_written()));
        r.value(&key.name, length.with_sigma(Length(size.sigma)));
    }
    let area = Resolved::new(bead.area.value, origin(false)).with_sigma(bead.area.sigma);
    r.value("waam.bead.area", with_unit(area, "mm²"));
}

/// The cell's controller; one that goes round corners unchanged where the cell does not tell.
fn controller(cell: &Cell) -> Controller {
    let motion = cell.motion.value.clone();
    motion.unwrap_or_else(Controller::without_corners)
}

/// Refuses a contact tube that begins at a distance that the checks do not let pass.
fn check_distance<T>(c: &ChecksTable, key: &Setting<T>, ctwd: f64) -> Result<(), Problem> {
    if c.ctwd_min.0 < ctwd {
        return Ok(());
    }
    let message = format!(
        "checks.ctwd_min is {}, and machine.ctwd {}: the first layer is laid no farther than beads may come near",
        *c.ctwd_min,
        Length(ctwd)
    );
    let problem = if c.ctwd_min.is_written() {
        c.ctwd_min.problem(message)
    } else {
        key.problem(message)
    };
    Err(problem.help("lower checks.ctwd_min, or raise machine.ctwd and lay the first layer there"))
}

fn limits(c: &ChecksTable, ctwd: f64, r: &mut Provenance) -> Limits {
    // a layer that lies higher or lower brings the contact tube that much nearer or farther
    let slack = (ctwd - c.ctwd_min.0).min(c.ctwd_max.0 - ctwd).max(0.0);
    Limits {
        ctwd_beyond: c.ctwd_beyond.0,
        lack: c.lack.0,
        excess: c.excess.0,
        accumulation: c.accumulation.0,
        overhang: c.overhang.0,
        joint_margin: c.joint_margin.0,
        tilt: c.tilt.map(|a| a.0),
        clearance: c.clearance.0,
        stock_min: c.stock_min.0,
        height_error: c.height_error.or_computed(r, Length(slack)).0,
        flatness: c.flatness.0,
        ctwd_min: c.ctwd_min.0,
        ctwd_max: c.ctwd_max.0,
    }
}

/// The models of the chain with their sources.
fn models(cell: &Cell, map: &ProcessMap, provenance: &mut Provenance) {
    let motion = match *cell.motion {
        Some(_) => {
            "Rouchon 2022, § 3.3.1: two moving averages; the dwell below 30° is an assumption"
        }
        None => "none: the cell has no corner model, the set speed is driven everywhere",
    };
    let law = match &map.law {
        Law::PowerLaw { .. } => "a power law",
        Law::Grid(_) => "sizes on a grid",
        Law::Fitted(_) => map.tried.first().map_or("laws through beads", |t| t.form),
    };
    let law = format!("{}: {law}, by the sources that its file names", map.id);
    let response = match &map.feed_response {
        Some(measured) => format!(
            "{}, as a line within the penetration stabiliser's band",
            measured.slope.source
        ),
        None => "none: the feed is that of the reference distance".to_owned(),
    };
    for (name, source) in [
        ("process map", &*law),
        ("filling", "Rouchon 2022, § 1.2.3.2, with rules of our own"),
        ("robot motion", motion),
        ("bead axis", "Rouchon 2022, § 3.3.2: pursuit curve"),
        (
            "deposit",
            "Rouchon 2022, § 3.5, eq. 3.10-3.13: cumulated double half-ellipsoids",
        ),
        ("wire feed against contact tube distance", &response),
        (
            "levelling of beads",
            "of our own, after the assembly model of Rouchon 2022, § 4.2-4.4 (walls 0.9 w wide)",
        ),
        (
            "decision rule",
            "guard bands of one standard uncertainty, after ISO 14253-1",
        ),
    ] {
        provenance.model(name, source);
    }
}

impl Settings {
    /// The dialects of its programs: those that the job asks for, else the cell's own.
    pub fn dialects(&self) -> Vec<Dialect> {
        match &self.programs[..] {
            [] => vec![self.cell.program.dialect.value],
            asked => asked.to_vec(),
        }
    }

    /// The dialect of the programs that are judged: the cell's, where its file writes one and the job asks for it; else the first that the job
    /// asks for of those that the arm's maker reads, or of all.
    pub fn judged(&self) -> Dialect {
        let own = &self.cell.program.dialect;
        match &self.programs[..] {
            asked if own.is_written() && asked.contains(&own.value) => own.value,
            [] => own.value,
            [first, ..] => {
                let maker = self
                    .robot
                    .as_ref()
                    .map_or(robot::Maker::Other, |cell| cell.maker);
                let own = self.programs.iter().find(|d| reads(maker, **d));
                *own.unwrap_or(first)
            }
        }
    }

    /// How many axes beside the arm programs tell, as the plan chooses them anew.
    fn free_axes(&self) -> usize {
        let free = self.external == ExternalChoice::Free;
        self.robot.as_ref().filter(|_| free).map_or(0, |cell| {
            let turning = cell.positioner.as_ref().map_or(0, |p| p.joints.len());
            usize::from(cell.track.is_some()) + turning
        })
    }

    /// Whether the cell has the words for every program that the job asks for: known before anything is planned.
    ///
    /// # Errors
    /// The dialect, and [`BuildError`] with the key that is missing.
    pub fn check_words(&self) -> Result<(), (Dialect, BuildError)> {
        let program = &self.cell.program;
        let check = |&dialect: &Dialect| {
            check_cell(program, dialect)
                .and_then(|()| match self.free_axes() {
                    0 => Ok(()),
                    axes => check_axes(axes, program, dialect),
                })
                .map_err(|why| (dialect, why))
        };
        self.programs.iter().try_for_each(check)
    }

    /// Standard uncertainty of growth, where the share `single` of the bead length stands alone.
    pub fn growth_error(&self, single: f64) -> GrowthError {
        let area = self.bead.area.sigma / self.bead.area.value;
        let width = self.bead.width.sigma / self.bead.width.value;
        GrowthError {
            share: (area * area + (single * width).powi(2)).sqrt(),
            response: self.deposit.feed_response,
        }
    }

    /// Standard uncertainty of where the metal ends beside the axis of its outermost bead, mm: half of that of the bead's width.
    pub fn edge_error(&self) -> f64 {
        0.5 * self.bead.width.sigma
    }

    /// Metal over faces that look up: as written, else what lies over sides, mm.
    pub fn least_over(&self) -> f64 {
        self.allowance_top.unwrap_or(self.allowance)
    }

    /// What the source feeds at a contact tube distance, mm, as a share of what it feeds at that of the process map.
    pub fn feed_at(&self, distance: f64) -> f64 {
        let response = self.deposit.feed_response;
        response.map_or(1.0, |r| r.ratio(distance))
    }

    /// Wire fed per programmed wire: the process map's feed factor.
    pub fn feed_factor(&self) -> f64 {
        self.map.feed_factor.0
    }
}
