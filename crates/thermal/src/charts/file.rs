//! Charts in files: the native container, with a checksum per column and a version.

use std::io::{self, Read, Write};

use meltpath_base::container::{Column, Container, ContainerError};
use serde::{Deserialize, Serialize};

use crate::charts::{
    COOLING_POINTS, Chart, ChartSet, ChartSettings, CoolingCurve, HEATING_POINTS, HeatingCurve,
    WarmGround,
};

/// Schema and version of chart files.
pub const CHART_SCHEMA: &str = "meltpath-chart/3";

/// Why a chart file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ChartFileError {
    /// Not a container, truncated or damaged.
    #[error(transparent)]
    Container(#[from] ContainerError),
    /// Another schema or version.
    #[error(
        "the file holds {found}, this meltpath reads {CHART_SCHEMA}: compute the charts again with this version"
    )]
    Schema {
        /// The schema found.
        found: String,
    },
    /// Columns that do not fit together.
    #[error("the charts in the file do not fit together: {what}; compute them again")]
    Shape {
        /// What does not fit.
        what: String,
    },
}

#[derive(Serialize, Deserialize)]
struct Meta {
    settings: ChartSettings,
    material: String,
    fingerprint: u32,
}

/// Writes the charts.
///
/// # Errors
/// What the writer says.
pub fn write(set: &ChartSet, out: &mut dyn Write) -> io::Result<()> {
    let mut container = Container::new(CHART_SCHEMA);
    container.meta = serde_json::to_value(Meta {
        settings: set.settings.clone(),
        material: set.material.clone(),
        fingerprint: set.fingerprint,
    })?;
    let mut put = |name: &str, column| container.columns.insert(name.to_owned(), column);
    put("depths", Column::F64(set.depths.clone()));
    put("distances", Column::F64(set.distances.clone()));
    let shares = set.charts.iter().map(|c| c.powder_share).collect();
    put("powder-shares", Column::F64(shares));
    let grounds = |of: fn(&WarmGround) -> f64| Column::F64(set.warm.iter().map(of).collect());
    put("ground-temperatures", grounds(|w| w.temperature));
    put("ground-enthalpies", grounds(|w| w.enthalpy));
    // cold ground first
    let all = || {
        let warm = set.warm.iter().flat_map(|w| &w.charts);
        set.charts.iter().chain(warm)
    };
    let heating = || all().flat_map(|c| &c.heating);
    let cooling = || all().flat_map(|c| &c.cooling);
    put(
        "heating-end",
        Column::F32(heating().map(|c| c.end).collect()),
    );
    put(
        "heating-times",
        Column::F32(heating().flat_map(|c| c.times.iter().copied()).collect()),
    );
    put(
        "cooling-from",
        Column::F32(cooling().map(|c| c.from).collect()),
    );
    put("cooling-to", Column::F32(cooling().map(|c| c.to).collect()));
    put(
        "cooling-times",
        Column::F32(cooling().flat_map(|c| c.times.iter().copied()).collect()),
    );
    container.write(out)
}

/// Reads charts and checks that they are sound.
///
/// # Errors
/// [`ChartFileError`]; never a panic, whatever the bytes.
pub fn read(input: &mut dyn Read) -> Result<ChartSet, ChartFileError> {
    let container = Container::read(input)?;
    if container.schema != CHART_SCHEMA {
        return Err(ChartFileError::Schema {
            found: container.schema,
        });
    }
    let shape = |what: String| ChartFileError::Shape { what };
    let meta: Meta =
        serde_json::from_value(container.meta.clone()).map_err(|e| shape(e.to_string()))?;
    let single = |name: &str| match container.columns.get(name) {
        Some(Column::F32(values)) if values.iter().all(|v| v.is_finite()) => Ok(values.as_slice()),
        Some(Column::F32(_)) => Err(shape(format!("a value of `{name}` is not finite"))),
        _ => Err(ContainerError::Column(name.to_owned()).into()),
    };
    let rising = |name: &str, least: usize| -> Result<Vec<f64>, ChartFileError> {
        let values = container.f64(name)?;
        let sound = values.len() >= least
            && values.iter().all(|v| v.is_finite())
            && values.windows(2).all(|w| w[0] < w[1]);
        sound
            .then(|| values.to_vec())
            .ok_or_else(|| shape(format!("`{name}` does not rise")))
    };
    let (depths, distances) = (rising("depths", 2)?, rising("distances", 2)?);
    let shares = rising("powder-shares", 1)?;
    let warm = rising("ground-temperatures", 0)?;
    let above = rising("ground-enthalpies", 0)?;
    if warm.len() != above.len() {
        return Err(shape("grounds without their enthalpies".to_owned()));
    }
    let all = shares.len() * (1 + warm.len());
    let per_chart = depths.len() * distances.len();
    let count = |name: &str, values: &[f32], wanted: usize| {
        if values.len() == wanted {
            Ok(())
        } else {
            let found = values.len();
            Err(shape(format!(
                "`{name}` has {found} values, {wanted} are needed"
            )))
        }
    };
    let (ends, heating) = (single("heating-end")?, single("heating-times")?);
    let (from, to) = (single("cooling-from")?, single("cooling-to")?);
    let cooling = single("cooling-times")?;
    let (hot, cold) = (all * per_chart, all * depths.len());
    count("heating-end", ends, hot)?;
    count("heating-times", heating, hot * HEATING_POINTS)?;
    count("cooling-from", from, cold)?;
    count("cooling-to", to, cold)?;
    count("cooling-times", cooling, cold * COOLING_POINTS)?;
    let falls = heating
        .chunks(HEATING_POINTS)
        .chain(cooling.chunks(COOLING_POINTS));
    if falls.flat_map(|c| c.windows(2)).any(|w| w[1] < w[0]) {
        return Err(shape("a time runs backwards".to_owned()));
    }
    let mut charts: Vec<Chart> = (0..all)
        .map(|m| Chart {
            powder_share: shares[m % shares.len()],
            heating: (m * per_chart..(m + 1) * per_chart)
                .map(|n| HeatingCurve {
                    end: ends[n],
                    times: heating[n * HEATING_POINTS..(n + 1) * HEATING_POINTS].to_vec(),
                })
                .collect(),
            cooling: (m * depths.len()..(m + 1) * depths.len())
                .map(|n| CoolingCurve {
                    from: from[n],
                    to: to[n],
                    times: cooling[n * COOLING_POINTS..(n + 1) * COOLING_POINTS].to_vec(),
                })
                .collect(),
        })
        .collect();
    let warm = warm
        .iter()
        .zip(above)
        .enumerate()
        .rev()
        .map(|(n, (temperature, enthalpy))| WarmGround {
            temperature: *temperature,
            enthalpy,
            charts: charts.split_off((n + 1) * shares.len()),
        });
    let mut warm: Vec<WarmGround> = warm.collect();
    warm.reverse();
    Ok(ChartSet {
        settings: meta.settings,
        material: meta.material,
        fingerprint: meta.fingerprint,
        depths,
        distances,
        charts,
        warm,
    })
}
