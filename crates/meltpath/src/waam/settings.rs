//! Every value of a wire-arc job resolved: what was written, the stated defaults, what the process map says.

use std::ops::Range;
use std::path::{Path, PathBuf};

use meltpath_base::quantity::Auto;
use meltpath_base::{Length, Origin, Provenance, Reporter, Resolved, Speed};
use meltpath_deposition::bead::{BeadModel, PoolModel, PursuitLength};
use meltpath_deposition::consumable::{DataError, Datum, Gas, Wire, nearest_pool, pools};
use meltpath_deposition::deposit;
use meltpath_deposition::energy::{EnergyBasis, EnergyPerVolume, energy_per_volume};
use meltpath_deposition::feed_response::FeedResponse;
use meltpath_deposition::process_map::{Bead, ProcessMap, Target};
use meltpath_deposition::stepover::{Overlap, fusion_at_risk, stepover};
use meltpath_geometry::math::DVec3;
use meltpath_planning::{
    ContourOrder, FillSettings, LineAngle, LineDirection, LineOrder, Paces, StartPoints, Strategy,
};

use super::judge::{GrowthError, Limits};
use super::target::Allowance;
use crate::data::{Cell, is_file};
use crate::job::waam::{
    FeedResponseChoice, FillOrder, FillStrategy, FillTable, SourceTable, Spacing, Speeds, Starts,
    Stepover,
};
use crate::job::{JobError, LayerHeights, PartUnit, TextError, WaamJob};

/// m/min per mm/s.
const PER_MINUTE: f64 = 0.06;

/// How many times beyond the range of its process map a bead is extrapolated, with a warning, before it is refused.
const FURTHEST: f64 = 2.0;

/// Thinnest and thickest layer, in heights of a single bead: below, the plan is hundreds of layers that no bead can make;
/// above, the beads never meet.
const THINNEST: f64 = 0.1;
const THICKEST: f64 = 3.0;

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
    /// Electric energy per volume of deposit, where it was measured for the mode.
    pub energy: Option<EnergyPerVolume>,
    /// The process map.
    pub map: ProcessMap,
    /// The single bead on a plate.
    pub bead: Bead,
    /// The bead as the deposit takes it.
    pub bead_model: BeadModel,
    /// The pool that lays it.
    pub pool: PoolModel,
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
    /// The cell.
    pub cell: Cell,
    /// Its name.
    pub cell_name: String,
    /// Smoothing at via points, 0 to 1.
    pub smoothing: f64,
    /// Contact tube to work distance at the first layer, mm.
    pub ctwd: f64,
    /// Plate: length and width, where given, mm.
    pub plate: Option<[f64; 2]>,
    /// Plate thickness, mm.
    pub plate_thickness: f64,
    /// Metal beyond the finished part.
    pub allowance: Allowance,
    /// Limits of the verdict.
    pub limits: Limits,
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
/// [`TextError`] with the place in the job where one value is to blame.
pub fn resolve(job: &WaamJob, folder: &Path, reporter: &Reporter) -> Result<Settings, TextError> {
    let mut r = Provenance::new();
    let at = |span: Range<usize>| {
        move |e: &dyn std::error::Error| TextError {
            span: Some(span.clone()),
            message: e.to_string(),
            help: None,
        }
    };
    let waam = &job.waam;
    let wire = Wire::builtin(waam.wire.get_ref()).map_err(|e| at(waam.wire.span())(&e))?;
    let gas = Gas::builtin(waam.gas.get_ref()).map_err(|e| at(waam.gas.span())(&e))?;
    let mode = waam.mode.get_ref().clone();
    let mut map = process_map(job, folder, &wire, reporter)?;
    if let Some(efficiency) = waam.efficiency {
        map.efficiency.value = efficiency.0.0;
        "the job".clone_into(&mut map.efficiency.source);
    }
    if let Some(factor) = waam.source.feed_factor {
        map = map.with_feed_factor(factor.0.0);
    }
    r.value("waam.wire", Resolved::new(wire.id.clone(), Origin::Job));
    r.value("waam.gas", Resolved::new(gas.id.clone(), Origin::Job));
    r.value("waam.mode", Resolved::new(mode.clone(), Origin::Job));
    r.value(
        "waam.map",
        Resolved::new(
            map.id.clone(),
            Origin::Data(format!("process map {}", map.id)),
        ),
    );
    let datum = |d: &meltpath_deposition::consumable::Datum| {
        let origin = Origin::Data(format!(
            "{}, {}{}",
            d.source,
            d.page,
            d.note
                .as_ref()
                .map(|n| format!(": {n}"))
                .unwrap_or_default()
        ));
        Resolved {
            value: d.value,
            origin,
            sigma: d.uncertainty,
        }
    };
    r.value("waam.efficiency", datum(&map.efficiency));
    let feed_factor = match waam.source.feed_factor {
        Some(factor) => Resolved::new(factor.0.0, Origin::Job),
        None => datum(&map.feed_factor),
    };
    r.value("waam.feed_factor", feed_factor);
    r.value("waam.wire_diameter_mm", datum(&wire.diameter));
    let energy = energy_of(&mut r, &wire, &mode, &gas).map_err(|e| at(waam.mode.span())(&e))?;
    let bead = solve_bead(job, &map)?;
    map.warn_about(&bead, reporter);
    check_heights(&job.layers.height, &bead)?;
    let computed = || Origin::Computed(format!("process map {}", map.id));
    let given = job
        .waam
        .bead
        .as_ref()
        .map(|b| *b.get_ref())
        .unwrap_or_default();
    let origin = |written: bool| if written { Origin::Job } else { computed() };
    r.value(
        "waam.bead.wire_feed",
        Resolved::new(Speed(bead.wire_feed), origin(given.wire_feed.is_some())),
    );
    r.value(
        "waam.bead.travel_speed",
        Resolved::new(
            Speed(bead.travel_speed),
            origin(given.travel_speed.is_some()),
        ),
    );
    r.value(
        "waam.bead.width",
        bead_length(&bead.width, origin(given.width.is_some())),
    );
    r.value(
        "waam.bead.height",
        bead_length(&bead.height, origin(given.height.is_some())),
    );
    r.value(
        "waam.bead.area_mm2",
        Resolved {
            value: bead.area.value,
            origin: computed(),
            sigma: Some(bead.area.sigma),
        },
    );
    let bead_model = bead.model(&map);
    let feed_response = feed_response(&mut r, &waam.source, &map, bead.wire_feed, reporter);
    let pool = pool_of(&wire.id, &mode, &gas.id, &bead, &bead_model, reporter);
    let width = bead.width.value;
    let step = resolve_stepover(&job.fill.stepover, width);
    r.value(
        "fill.stepover",
        Resolved::new(Length(step.value), step.origin.clone()),
    );
    if fusion_at_risk(bead.wire_feed / bead.travel_speed, step.value / width) {
        reporter.warn(
            "stepover-fusion",
            format!("flat beads (ratio of wire feed to travel speed {:.1}) {:.2} widths apart may not fuse at their feet", bead.wire_feed / bead.travel_speed, step.value / width),
            "set fill.stepover to \"0.70 w\" or less",
        );
    }
    let fill = fill_settings(&mut r, &job.fill, width, step.value, bead.travel_speed);
    fill.check().map_err(|e| TextError {
        span: None,
        message: e.to_string(),
        help: None,
    })?;
    let cell_name = job
        .machine
        .cell
        .as_ref()
        .map_or_else(|| "arcmate-120ic".to_owned(), |c| c.get_ref().clone());
    let cell = Cell::load(&cell_name, folder).map_err(|e| match &job.machine.cell {
        Some(c) => at(c.span())(&e),
        None => TextError {
            span: None,
            message: e.to_string(),
            help: None,
        },
    })?;
    r.written_or(
        "machine.cell",
        job.machine.cell.as_ref().map(|_| cell_name.clone()),
        cell_name.clone(),
        "the cell that ships",
    );
    let smoothing = r
        .written_or(
            "machine.smoothing",
            job.machine.smoothing,
            meltpath_base::Ratio(0.5),
            "CNT50, the reference of Rouchon 2022",
        )
        .0;
    let ctwd = r
        .written_or(
            "machine.ctwd",
            job.machine.ctwd.map(|c| c.0),
            cell.program.contact_tube_distance,
            "the cell's nominal distance",
        )
        .0;
    let pause = r
        .written_or(
            "layers.pause",
            job.layers.pause.map(|p| p.0),
            meltpath_base::Time(0.0),
            "no pause",
        )
        .0;
    let plate_thickness = r
        .written_or(
            "substrate.thickness",
            job.substrate.thickness.map(|t| t.0),
            Length(20.0),
            "the plate of Rouchon 2022, p. 38",
        )
        .0;
    let allowance = r
        .written_or(
            "target.allowance",
            job.target.allowance.map(|a| a.0),
            Length(2.0),
            "usual machining stock of a wire-arc blank",
        )
        .0;
    let allowance_top = r
        .written_or(
            "target.allowance_top",
            job.target.allowance_top.map(|a| a.0),
            Length(allowance),
            "the allowance",
        )
        .0;
    let cell_size = r
        .written_or(
            "simulation.cell",
            job.simulation.cell.map(|c| c.0),
            Length(0.5),
            "a thirteenth of a usual bead",
        )
        .0;
    let chord_error = r
        .written_or(
            "simulation.chord_error",
            job.simulation.chord_error.map(|c| c.0),
            Length(0.02),
            "far below a bead's scatter",
        )
        .0;
    if let Auto::Value(heights) = &job.layers.height {
        r.value("layers.height", Resolved::new(heights.clone(), Origin::Job));
    }
    let limits = limits(&mut r, job);
    let up = job.build_direction.map_or(DVec3::Z, DVec3::from_array);
    r.written_or(
        "build_direction",
        job.build_direction,
        [0.0, 0.0, 1.0],
        "+Z of the part file",
    );
    models(&mut r);
    Ok(Settings {
        part: folder.join(job.part.get_ref()),
        part_unit: job.part_unit,
        up,
        wire,
        gas,
        mode,
        energy,
        bead,
        bead_model,
        pool,
        deposit: deposit::Settings {
            nominal_ctwd: ctwd,
            feed_response,
            ..deposit::Settings::default()
        },
        map,
        stepover: step,
        fill,
        heights: job.layers.height.clone(),
        count: job.layers.count,
        pause,
        cell,
        cell_name,
        smoothing,
        ctwd,
        plate: job.substrate.size.map(|s| s.map(|l| l.0.0)),
        plate_thickness,
        allowance: Allowance {
            side: allowance,
            top: allowance_top,
        },
        limits,
        cell_size,
        chord_error,
        provenance: r,
    })
}

fn bead_length(
    estimate: &meltpath_deposition::process_map::Estimate,
    origin: Origin,
) -> Resolved<Length> {
    Resolved {
        value: Length(estimate.value),
        origin,
        sigma: Some(Length(estimate.sigma)),
    }
}

fn process_map(
    job: &WaamJob,
    folder: &Path,
    wire: &Wire,
    reporter: &Reporter,
) -> Result<ProcessMap, TextError> {
    let waam = &job.waam;
    let id = format!("{}-{}-{}", wire.id, waam.mode.get_ref(), waam.gas.get_ref());
    let Some(file) = &waam.map else {
        return ProcessMap::builtin(&id).map_err(|e| TextError {
            span: Some(waam.mode.span()),
            message: e.to_string(),
            help: Some(
                "measure a map for this wire, mode and gas, and name it: map = \"my-map.toml\""
                    .to_owned(),
            ),
        });
    };
    let at = |message: String| TextError {
        span: Some(file.span()),
        message,
        help: None,
    };
    let name = file.get_ref();
    if !is_file(name) {
        return ProcessMap::builtin(name).map_err(|e| at(e.to_string()));
    }
    let text = std::fs::read_to_string(folder.join(name))
        .map_err(|e| at(format!("cannot read the process map {name}: {e}")))?;
    let map = ProcessMap::parse(name, &text, wire, reporter).map_err(|e| at(e.to_string()))?;
    for (what, of_map, of_job) in [
        ("wire", &map.wire, &wire.id),
        ("gas", &map.gas, waam.gas.get_ref()),
        ("mode", &map.mode, waam.mode.get_ref()),
    ] {
        if of_map != of_job {
            return Err(at(format!(
                "the process map is for {what} \"{of_map}\", the job for \"{of_job}\""
            )));
        }
    }
    Ok(map)
}

/// What the source feeds at other contact tube distances: on where the process map knows, for wire, gas and mode.
fn feed_response(
    r: &mut Provenance,
    source: &SourceTable,
    map: &ProcessMap,
    wire_feed: f64,
    reporter: &Reporter,
) -> Option<FeedResponse> {
    const NAME: &str = "waam.source.feed_response";
    if source.feed_response == FeedResponseChoice::Off {
        r.value(NAME, Resolved::new("off", Origin::Job));
        return None;
    }
    let stabiliser = source.penetration_stabiliser.map(|s| s.0.0);
    let Some(measured) = &map.feed_response else {
        if stabiliser.is_some_and(|s| s > 0.0) {
            reporter.warn(
                "feed-response-unknown",
                format!("the process map {} does not say what the source feeds at other contact tube distances: the penetration stabiliser is left out", map.id),
                "measure the wire feed on the first and on a high layer of a wall, and add a table [feed_response] to the map",
            );
        }
        let why = "not measured for this wire, gas and mode".to_owned();
        r.value(NAME, Resolved::new("off", Origin::Default(why)));
        return None;
    };
    let from_map = |d: &Datum| Origin::Data(format!("{}, {}", d.source, d.page));
    let slope = &measured.slope;
    r.value(NAME, Resolved::new("on", from_map(slope)));
    r.value(
        "waam.source.feed_slope_m_min_per_mm",
        Resolved {
            value: slope.value,
            origin: from_map(slope),
            sigma: slope.uncertainty,
        },
    );
    r.value(
        "waam.source.feed_reference_ctwd",
        Resolved {
            value: Length(measured.reference.value),
            origin: from_map(&measured.reference),
            sigma: measured.reference.uncertainty.map(Length),
        },
    );
    let band = match stabiliser {
        Some(s) => Resolved::new(Speed(s), Origin::Job),
        None => Resolved::new(
            Speed(measured.stabiliser.value / PER_MINUTE),
            from_map(&measured.stabiliser),
        ),
    };
    r.value("waam.source.penetration_stabiliser", band);
    map.response(wire_feed, stabiliser)
}

fn solve_bead(job: &WaamJob, map: &ProcessMap) -> Result<Bead, TextError> {
    let given = job.waam.bead.as_ref();
    let b = given.map(|b| *b.get_ref()).unwrap_or_default();
    let mut target = Target {
        wire_feed: b.wire_feed.map(|v| v.0.0),
        travel_speed: b.travel_speed.map(|v| v.0.0),
        width: b.width.map(|v| v.0.0),
        height: b.height.map(|v| v.0.0),
    };
    if target == Target::default() {
        let middle = |(low, high): (f64, f64)| Some(0.5 * (low + high) / PER_MINUTE);
        target.wire_feed = middle(map.validity.wire_feed);
        target.travel_speed = middle(map.validity.travel_speed);
    }
    let beads = map.solve(&target).map_err(|e| TextError {
        span: given.map(toml::Spanned::span),
        message: e.to_string(),
        help: None,
    })?;
    let bead = beads.first().copied().ok_or_else(|| TextError {
        span: given.map(toml::Spanned::span),
        message: "the process map has no bead for these values".to_owned(),
        help: None,
    })?;
    let v = &map.validity;
    let far = |speed: f64, (low, high): (f64, f64)| {
        !(low / FURTHEST..=high * FURTHEST).contains(&(speed * PER_MINUTE))
    };
    if far(bead.wire_feed, v.wire_feed) || far(bead.travel_speed, v.travel_speed) {
        return Err(TextError {
            span: given.map(toml::Spanned::span),
            message: format!(
                "the map \"{}\" cannot make a bead of {:.2} m/min wire feed at {:.3} m/min travel: it knows {} to {} m/min by {} to {} m/min, and {FURTHEST} times beyond that nothing can be said",
                map.id,
                bead.wire_feed * PER_MINUTE,
                bead.travel_speed * PER_MINUTE,
                v.wire_feed.0,
                v.wire_feed.1,
                v.travel_speed.0,
                v.travel_speed.1
            ),
            help: Some("choose settings inside the map, or measure beads there and name that map: map = \"my-map.toml\"".to_owned()),
        });
    }
    Ok(bead)
}

/// Refuses layers that no such bead can make.
fn check_heights(heights: &Auto<LayerHeights>, bead: &Bead) -> Result<(), TextError> {
    let Auto::Value(list) = heights else {
        return Ok(());
    };
    let h = bead.height.value;
    let (least, most) = (THINNEST * h, THICKEST * h);
    match list
        .0
        .iter()
        .map(|l| l.0.0)
        .find(|l| !(least..=most).contains(l))
    {
        None => Ok(()),
        Some(bad) => Err(TextError {
            span: None,
            message: format!(
                "layers.height {bad} mm cannot be built with a bead {h:.2} mm high: between {least:.2} and {most:.2} mm could"
            ),
            help: Some("write height = \"auto\", or choose another bead".to_owned()),
        }),
    }
}

/// The pool measured for this configuration, or the only one there is, said so; scaled to the bead.
fn pool_of(
    wire: &str,
    mode: &str,
    gas: &str,
    bead: &Bead,
    model: &BeadModel,
    reporter: &Reporter,
) -> PoolModel {
    const MEASURED: &str = "x90-ig-1.0-cmt-m14";
    let own = pools(&format!("{wire}-{mode}-{gas}"));
    if own.is_err() {
        reporter.warn("pool-borrowed", format!("no weld pool was measured for {wire}, {mode}, {gas}: that of {MEASURED} is scaled to the bead"), "");
    }
    let rows = own.or_else(|_| pools(MEASURED)).unwrap_or_default();
    match nearest_pool(&rows, bead.wire_feed, bead.travel_speed) {
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

fn resolve_stepover(written: &Auto<Stepover>, width: f64) -> Resolved<f64> {
    match *written {
        Auto::Auto => Resolved::new(
            stepover(Overlap::Tangent) * width,
            Origin::Computed(
                "tangent overlap, 0.738 of the bead's width (Ding; Rouchon 2022, § 4.1)".to_owned(),
            ),
        ),
        Auto::Value(Stepover::Length(l)) => Resolved::new(l.0, Origin::Job),
        Auto::Value(Stepover::Widths(n)) => Resolved::new(n * width, Origin::Job),
    }
}

fn fill_settings(
    r: &mut Provenance,
    table: &FillTable,
    width: f64,
    step: f64,
    travel_speed: f64,
) -> FillSettings {
    let strategy = r.written_or(
        "fill.strategy",
        table.strategy,
        FillStrategy::Hybrid,
        "contour outside, few arc stops inside",
    );
    let starts = r.written_or(
        "fill.starts",
        table.starts,
        Starts::Spread,
        "start defects do not stack",
    );
    let spacing = r.written_or(
        "fill.spacing",
        table.spacing,
        Spacing::Adjust,
        "fills the width exactly",
    );
    let (usual, why) = match strategy {
        FillStrategy::Hybrid | FillStrategy::Zigzag => (
            Speeds::Adapted,
            "links and turns lie near other beads: as much metal everywhere",
        ),
        FillStrategy::Raster | FillStrategy::Contour | FillStrategy::Spiral => {
            (Speeds::Constant, "beads lie evenly")
        }
    };
    let speeds = r.written_or("fill.speeds", table.speeds, usual, why);
    let quarter = if strategy == FillStrategy::Raster {
        0.0
    } else {
        std::f64::consts::FRAC_PI_2
    };
    let angle = match (table.angle, table.turn) {
        // a raster keeps the direction with the fewest lines; zigzags cross from layer to layer, so that gaps and reversals do
        // not stack
        (None, None) if strategy == FillStrategy::Raster => LineAngle::Best,
        (first, turn) => LineAngle::Turning {
            first: first.map_or(0.0, |a| a.0),
            step: turn.map_or(quarter, |a| a.0),
        },
    };
    let contours = table.contours.unwrap_or(1);
    let contour_order = match table.order {
        Some(FillOrder::OutsideIn) => ContourOrder::OutsideIn,
        _ => ContourOrder::InsideOut,
    };
    let planned = match strategy {
        FillStrategy::Raster => Strategy::Raster {
            angle,
            order: if table.order == Some(FillOrder::CentreOut) {
                LineOrder::CentreOut
            } else {
                LineOrder::Across
            },
            direction: match table.order {
                Some(FillOrder::OneWay) => LineDirection::OneWay,
                Some(FillOrder::AlternateBeads) => LineDirection::AlternatePerBead,
                _ => LineDirection::AlternatePerLayer,
            },
        },
        FillStrategy::Zigzag => Strategy::Zigzag { angle },
        FillStrategy::Contour => Strategy::Contour {
            order: contour_order,
        },
        FillStrategy::Spiral => Strategy::Spiral {
            order: contour_order,
        },
        // contours last: between finished contours the last line would pile up
        FillStrategy::Hybrid => Strategy::Hybrid {
            contours,
            order: contour_order,
            angle,
        },
    };
    FillSettings {
        strategy: planned,
        spacing: match spacing {
            Spacing::Adjust => meltpath_planning::Spacing::Fill,
            Spacing::Exact => meltpath_planning::Spacing::Exact,
        },
        starts: match starts {
            Starts::Spread => StartPoints::Spread,
            Starts::Aligned => StartPoints::Aligned,
        },
        paces: match speeds {
            Speeds::Adapted => Some(Paces::about(travel_speed)),
            Speeds::Constant => None,
        },
        ..FillSettings::new(width, step)
    }
}

fn limits(r: &mut Provenance, job: &WaamJob) -> Limits {
    use meltpath_base::Ratio;
    let c = &job.checks;
    let usual = "a usual limit for a blank to be machined";
    let mut ratio = |name: &str, written: Option<Ratio>, default: f64| {
        r.written_or(name, written, Ratio(default), usual).0
    };
    let lack = ratio("checks.lack", c.lack.map(|v| v.0), 0.005);
    let excess = ratio("checks.excess", c.excess.map(|v| v.0), 0.3);
    let accumulation = ratio("checks.accumulation", c.accumulation.map(|v| v.0), 1.0);
    let overhang = ratio("checks.overhang", c.overhang.map(|v| v.0), 0.25);
    let mut length = |name: &str, written: Option<Length>, default: f64| {
        r.written_or(name, written, Length(default), usual).0
    };
    Limits {
        lack,
        excess,
        accumulation,
        overhang,
        stock_min: length("checks.stock_min", c.stock_min, 0.3),
        height_error: length("checks.height_error", c.height_error.map(|v| v.0), 1.0),
        flatness: length("checks.flatness", c.flatness.map(|v| v.0), 1.5),
        ctwd_min: length("checks.ctwd_min", c.ctwd_min.map(|v| v.0), 8.0),
        ctwd_max: length("checks.ctwd_max", c.ctwd_max.map(|v| v.0), 20.0),
    }
}

/// The energy per volume of this wire, mode and gas.
fn energy_of(
    r: &mut Provenance,
    wire: &Wire,
    mode: &str,
    gas: &Gas,
) -> Result<Option<EnergyPerVolume>, DataError> {
    let energy = energy_per_volume(wire.diameter.value, mode, &gas.id)?;
    if let Some(energy) = &energy {
        let beads = match energy.basis {
            EnergyBasis::Configuration => "beads of this wire, mode and gas",
            EnergyBasis::Mode => "beads of this mode with other wires or gases",
        };
        r.value(
            "waam.energy_per_volume_j_mm3",
            Resolved {
                value: energy.mean,
                origin: Origin::Data(format!("{}: {beads}", energy.source)),
                sigma: Some(energy.sigma),
            },
        );
    }
    Ok(energy)
}

/// The models of the chain with their sources.
fn models(provenance: &mut Provenance) {
    for (name, source) in [
        (
            "process map",
            "Rouchon 2022, § 2.1.2, 2.3; seed law of our own through its published points",
        ),
        ("filling", "Rouchon 2022, § 1.2.3.2, with rules of our own"),
        (
            "robot motion",
            "Rouchon 2022, § 3.3.1: two moving averages; the dwell below 30° is an assumption",
        ),
        ("bead axis", "Rouchon 2022, § 3.3.2: pursuit curve"),
        (
            "deposit",
            "Rouchon 2022, § 3.5, eq. 3.10-3.13: cumulated double half-ellipsoids",
        ),
        (
            "wire feed against contact tube distance",
            "Rouchon 2022, table 4.4, as a line within the penetration stabiliser's band",
        ),
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
    /// Standard uncertainty of growth, where the share `single` of the bead length stands alone.
    pub fn growth_error(&self, single: f64) -> GrowthError {
        let area = self.bead.area.sigma / self.bead.area.value;
        let width = self.bead.width.sigma / self.bead.width.value;
        GrowthError {
            share: (area * area + (single * width).powi(2)).sqrt(),
            response: self.deposit.feed_response,
        }
    }

    /// Wire fed per programmed wire: the process map's feed factor.
    pub fn feed_factor(&self) -> f64 {
        self.map.feed_factor.value
    }
}

/// A [`TextError`] of a job file with the file's name and text.
pub fn in_file(path: &Path, text: &str, e: TextError) -> JobError {
    JobError::Text {
        path: path.to_path_buf(),
        text: text.to_owned(),
        span: e.span,
        message: e.message,
        help: e.help,
    }
}
