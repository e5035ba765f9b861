//! ArcTech's weld data sets and the lines round a move that use them.

use std::fmt::Write as _;

use meltpath_toolpath::{Weave, WeaveShape};

use super::data::{Field, fields, number_of, text_of};
use super::words::{KrlWords, WeaveAmplitude};
use crate::weave::told;
use crate::written::short;

/// Channels of a weld data set.
const CHANNELS: usize = 8;

/// A weld data set: what its channels hold, and the speed of what is laid with it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WeldData {
    /// The values of the channels, with commas.
    pub(super) arguments: String,
    /// Speed, mm/s.
    pub(super) speed: f64,
    /// How the torch swings, where it does; the pattern where it is not known what that is.
    pub(super) weave: Option<Result<Weave, String>>,
    /// How long the arc stands where it starts, s.
    pub(super) stands: f64,
}

/// How the arc ends by a weld data set.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Crater {
    /// How long it stands, s.
    pub(super) stands: f64,
    /// The values of the channels meanwhile, with commas.
    pub(super) arguments: String,
}

/// What a weld data set says of the begins and the ends of beads that is not simulated.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Advanced {
    /// Where the arc starts with it, or goes on with it.
    pub(super) on: Vec<String>,
    /// Where the arc ends with it.
    pub(super) off: Vec<String>,
}

/// The pattern in which the torch goes straight from side to side.
const ZIGZAG: &str = "#Triangle";

/// How the torch swings with weld data of a speed, mm/s, as the group says it.
fn weave(
    group: &[(String, Field)],
    speed: f64,
    amplitude: Option<WeaveAmplitude>,
) -> Option<Result<Weave, String>> {
    let pattern = text_of(group, "Pattern")?;
    if pattern.eq_ignore_ascii_case("#None") {
        return None;
    }
    let number = |name: &str| number_of(group, name);
    let plain = ["Angle", "LeftSideDelay", "RightSideDelay"];
    let plain = plain.iter().all(|name| number(name).unwrap_or(0.0) == 0.0);
    let zigzag = plain && pattern.eq_ignore_ascii_case(ZIGZAG);
    let known = number("Length")
        .zip(number("Amplitude"))
        .zip(amplitude.filter(|_| zigzag));
    let known = known.filter(|((length, wide), _)| *length > 0.0 && *wide > 0.0);
    Some(known.map_or(Err(pattern), |((length, wide), amplitude)| {
        Ok(told(&Weave {
            shape: WeaveShape::Triangle,
            frequency: speed / length,
            amplitude: wide / amplitude.per_side(),
            dwell: [0.0; 2],
        }))
    }))
}

/// Pattern, length and amplitude of a weave with weld data of a speed, mm/s; ArcTech's own where there is none.
fn written_weave(data: &WeldData, amplitude: Option<WeaveAmplitude>) -> String {
    let Some(Ok(weave)) = &data.weave else {
        return "Pattern #None,Length 4.0,Amplitude 2.0".to_owned();
    };
    let per_side = amplitude.map_or(1.0, WeaveAmplitude::per_side);
    format!(
        "Pattern {ZIGZAG},Length {},Amplitude {}",
        short(data.speed / weave.frequency, 6),
        short(per_side * weave.amplitude, 4)
    )
}

fn channels(arguments: &str) -> String {
    let mut values = arguments.split(',').map(str::trim);
    let mut text = String::new();
    for i in 1..=CHANNELS {
        let value = values.next().filter(|v| !v.is_empty()).unwrap_or("0.0");
        // writing to a String cannot fail
        let _ = write!(text, ",Channel{i} {value}");
    }
    text
}

/// How many values ArcTech takes.
pub(super) fn fits(arguments: &str) -> bool {
    let values: Vec<&str> = arguments.split(',').collect();
    values.len() <= CHANNELS
        && values
            .iter()
            .all(|v| v.trim().parse::<f64>().is_ok_and(f64::is_finite))
}

/// The declaration of weld data set `number`.
pub(super) fn declaration(number: usize, data: &WeldData, words: &KrlWords) -> String {
    let channels = channels(&data.arguments);
    let mode = words.job_mode.as_str();
    let time = |t: &meltpath_base::Time| short(t.0, 3);
    let (strike, weld, crater) = (&*words.strike_set, &*words.weld_set, &*words.crater_set);
    let (preflow, start) = (time(&words.preflow), time(&words.start_time));
    let (stands, postflow) = (time(&words.crater_time), time(&words.postflow));
    let velocity = short(data.speed / 1000.0, 6);
    let weave = written_weave(data, *words.weave_amplitude);
    format!(
        "DECL stArcDat_T WDAT{number}={{WdatId[] \"WDAT{number}\",\
         Strike {{JobModeId[] \"{mode}\",ParamSetId[] \"{strike}\",StartTime {start},PreFlowTime {preflow}{channels},PurgeTime 0.0}},\
         Weld {{JobModeId[] \"{mode}\",ParamSetId[] \"{weld}\",Velocity {velocity}{channels}}},\
         Crater {{JobModeId[] \"{mode}\",ParamSetId[] \"{crater}\",CraterTime {stands},PostflowTime {postflow}{channels},BurnBackTime 0.0}},\
         Weave {{{weave},Angle 0.0,LeftSideDelay 0.0,RightSideDelay 0.0}},\
         Advanced {{IgnitionErrorStrategy 1,WeldErrorStrategy 1,SlopeOption #None,SlopeTime 0.0,SlopeDistance 0.0,\
         OnTheFlyActiveOn FALSE,OnTheFlyActiveOff FALSE,OnTheFlyDistanceOn 0.0,OnTheFlyDistanceOff 0.0}}}}"
    )
}

/// The declaration of the seam that starts with strike `number`.
pub(super) fn seam(number: usize) -> String {
    format!(
        "DECL stArcDat_T WP{number}={{Strike {{SeamName[] \" \",SeamNumber -1}},Advanced {{BitCodedRobotMark 0}}}}"
    )
}

/// Longer than any arc stands, s.
const LONGEST: f64 = 86_400.0;
/// Faster than any robot welds, m/s.
const FASTEST: f64 = 100.0;

/// The weld part of a declaration; nothing where it has none, or tells no speed. `values` says how many channels mean something, `amplitude` what that of
/// a weave is.
pub(super) fn weld_data(
    text: &str,
    values: usize,
    amplitude: Option<WeaveAmplitude>,
) -> Option<WeldData> {
    let all = fields(text)?;
    let group = |name: &str| group_of(&all, name);
    let weld = group("Weld")?;
    let velocity = number_of(weld, "Velocity").filter(|v| (0.0..=FASTEST).contains(v))?;
    let speed = (1e12 * velocity).round() / 1e9;
    Some(WeldData {
        arguments: told_channels(weld, values),
        speed,
        weave: group("Weave").and_then(|group| weave(group, speed, amplitude)),
        stands: group("Strike").map_or(0.0, |g| time_of(g, "StartTime")),
    })
}

/// The values of a group's channels, with commas.
fn told_channels(group: &[(String, Field)], values: usize) -> String {
    let mut channels: Vec<f64> = (1..=CHANNELS)
        .map_while(|i| number_of(group, &format!("Channel{i}")))
        .collect();
    while channels.len() > values.max(1) && channels.last() == Some(&0.0) {
        channels.pop();
    }
    let all: Vec<String> = channels.iter().map(ToString::to_string).collect();
    all.join(",")
}

/// A time of a group, s.
fn time_of(group: &[(String, Field)], name: &str) -> f64 {
    let time = number_of(group, name);
    time.filter(|t| (0.0..=LONGEST).contains(t)).unwrap_or(0.0)
}

/// A group of a declaration.
fn group_of<'a>(all: &'a [(String, Field)], name: &str) -> Option<&'a Vec<(String, Field)>> {
    match all.iter().find(|(key, _)| key.eq_ignore_ascii_case(name)) {
        Some((_, Field::Group(inner))) => Some(inner),
        _ => None,
    }
}

/// The crater part of a declaration; nothing where it has none.
pub(super) fn crater(text: &str, values: usize) -> Option<Crater> {
    let all = fields(text)?;
    let group = group_of(&all, "Crater")?;
    Some(Crater {
        stands: time_of(group, "CraterTime"),
        arguments: told_channels(group, values),
    })
}

/// The first mode of the source that a declaration sets and that is not the cell's.
pub(super) fn other_mode(text: &str, own: &str) -> Option<String> {
    let all = fields(text)?;
    let groups = ["Strike", "Weld", "Crater"].into_iter();
    let modes = groups.filter_map(|name| text_of(group_of(&all, name)?, "JobModeId"));
    let mut others = modes.filter(|mode| !mode.trim().eq_ignore_ascii_case(own));
    others.next()
}

/// What the advanced part of a declaration switches on.
pub(super) fn advanced(text: &str) -> Advanced {
    let all = fields(text).unwrap_or_default();
    let Some(group) = group_of(&all, "Advanced") else {
        return Advanced::default();
    };
    let told = |key: &str| {
        let value = text_of(group, key).unwrap_or_default();
        format!("{key} {value}")
    };
    let flies = |key: &str| text_of(group, key).is_some_and(|v| v.eq_ignore_ascii_case("TRUE"));
    let slope = text_of(group, "SlopeOption").is_some_and(|v| !v.eq_ignore_ascii_case("#None"));
    let slope = slope.then(|| told("SlopeOption"));
    let [on, off] = ["OnTheFlyActiveOn", "OnTheFlyActiveOff"].map(|key| {
        let fly = flies(key).then(|| told(key));
        fly.into_iter().chain(slope.clone()).collect()
    });
    Advanced { on, off }
}

/// What ArcTech does with a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// The arc starts at its end.
    On,
    /// The arc goes on with other weld data.
    Switch,
    /// The arc ends at its end.
    Off,
}

impl Form {
    const ALL: [Form; 3] = [Form::On, Form::Switch, Form::Off];

    /// The lines before and the line after a move, for weld data set `data` and seam `seam`.
    pub(super) fn lines(self, data: usize, seam: usize) -> (Vec<String>, String) {
        self.lines_of(&format!("WDAT{data}"), &format!("WP{seam}"))
    }

    /// The same by the names of weld data and seam. The last before the move is the call, the others are triggers.
    fn lines_of(self, data: &str, seam: &str) -> (Vec<String>, String) {
        let call = |word: &str| format!("ArcMainNG(#{word},{data},{seam})");
        let delay = |word: &str| format!("ArcGetDelay(#{word},{data})");
        let path = |word: &str| format!("PATH=ArcGetPath(#{word},{data})");
        let trigger = |at: &str, delay: &str, word: &str| {
            format!("TRIGGER WHEN {at} DELAY={delay} DO {} PRIO=-1", call(word))
        };
        match self {
            Form::On => {
                let fly = path("OnTheFlyArcOn");
                let before = vec![
                    trigger("DISTANCE=1", &delay("PreDefinition"), "PreDefinition"),
                    trigger(&fly, &delay("GasPreflow"), "GasPreflow"),
                    trigger(&fly, "0", "ArcOnMoveStd"),
                    call("ArcOnBeforeMoveStd"),
                ];
                (before, call("ArcOnAfterMoveStd"))
            }
            Form::Switch => {
                let before = vec![
                    trigger("DISTANCE=1", "0", "ArcSwiMoveStd"),
                    call("ArcSwiBeforeMoveStd"),
                ];
                (before, call("ArcSwiAfterMoveStd"))
            }
            Form::Off => {
                let before = vec![
                    trigger(&path("ArcOffBefore"), "0", "ArcOffBeforeOffStd"),
                    trigger(&path("OnTheFlyArcOff"), "0", "ArcOffMoveStd"),
                    call("ArcOffBeforeMoveStd"),
                ];
                (before, call("ArcOffAfterMoveStd"))
            }
        }
    }
}

/// A line of an inline form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FormLine {
    pub(super) form: Form,
    pub(super) part: FormPart,
    /// The name of its weld data.
    pub(super) data: String,
}

/// Where in its form a line stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FormPart {
    Trigger,
    Before,
    After,
}

/// The line of an inline form that this is, to the letter but for spaces and capitals; nothing where it calls `ArcMainNG` otherwise.
pub(super) fn form_line(line: &str) -> Option<FormLine> {
    let line = squeezed(line);
    let (_, inner) = line.split_once("ARCMAINNG(")?;
    let (inner, _) = inner.split_once(')')?;
    let [_, data, seam] = inner.split(',').collect::<Vec<_>>()[..] else {
        return None;
    };
    Form::ALL.into_iter().find_map(|form| {
        let (before, after) = form.lines_of(data, seam);
        let last = before.len().saturating_sub(1);
        let part = if squeezed(&after) == line {
            FormPart::After
        } else {
            let at = before.iter().position(|l| squeezed(l) == line)?;
            if at == last {
                FormPart::Before
            } else {
                FormPart::Trigger
            }
        };
        Some(FormLine {
            form,
            part,
            data: data.to_owned(),
        })
    })
}

/// A line without spaces, in capitals.
fn squeezed(line: &str) -> String {
    let letters = line.chars().filter(|c| !c.is_whitespace());
    letters.map(|c| c.to_ascii_uppercase()).collect()
}
