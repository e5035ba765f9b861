//! ArcTech's weld data sets and the lines round a move that use them.

use std::fmt::Write as _;

use super::data::{Field, fields, number_of, text_of};
use super::words::KrlWords;
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
    /// A pattern in which the torch swings, where it does.
    pub(super) weave: Option<String>,
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
    format!(
        "DECL stArcDat_T WDAT{number}={{WdatId[] \"WDAT{number}\",\
         Strike {{JobModeId[] \"{mode}\",ParamSetId[] \"{strike}\",StartTime {start},PreFlowTime {preflow}{channels},PurgeTime 0.0}},\
         Weld {{JobModeId[] \"{mode}\",ParamSetId[] \"{weld}\",Velocity {velocity}{channels}}},\
         Crater {{JobModeId[] \"{mode}\",ParamSetId[] \"{crater}\",CraterTime {stands},PostflowTime {postflow}{channels},BurnBackTime 0.0}},\
         Weave {{Pattern #None,Length 4.0,Amplitude 2.0,Angle 0.0,LeftSideDelay 0.0,RightSideDelay 0.0}},\
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

/// The weld part of a declaration; nothing where it has none. `values` says how many channels mean something.
pub(super) fn weld_data(text: &str, values: usize) -> Option<WeldData> {
    let all = fields(text)?;
    let group = |name: &str| match all.iter().find(|(key, _)| key.eq_ignore_ascii_case(name)) {
        Some((_, Field::Group(inner))) => Some(inner),
        _ => None,
    };
    let weld = group("Weld")?;
    let speed = 1000.0 * number_of(weld, "Velocity")?;
    let mut channels: Vec<f64> = (1..=CHANNELS)
        .map_while(|i| number_of(weld, &format!("Channel{i}")))
        .collect();
    while channels.len() > values.max(1) && channels.last() == Some(&0.0) {
        channels.pop();
    }
    let arguments: Vec<String> = channels.iter().map(ToString::to_string).collect();
    let pattern = group("Weave").and_then(|weave| text_of(weave, "Pattern"));
    Some(WeldData {
        arguments: arguments.join(","),
        speed: (speed * 1e9).round() / 1e9,
        weave: pattern.filter(|p| !p.eq_ignore_ascii_case("#None")),
    })
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
    /// What `ArcMainNG` is told in the line before the move.
    const BEFORE: [(Form, &'static str); 3] = [
        (Form::On, "#ArcOnBefore"),
        (Form::Switch, "#ArcSwiBefore"),
        (Form::Off, "#ArcOffBefore"),
    ];

    /// The form that a call in front of a move begins.
    pub(super) fn begun_by(word: &str) -> Option<Form> {
        let begins = |w: &str| {
            word.get(..w.len())
                .is_some_and(|head| head.eq_ignore_ascii_case(w))
        };
        Form::BEFORE
            .into_iter()
            .find(|(_, w)| begins(w))
            .map(|(form, _)| form)
    }

    /// The lines before and the line after a move, for weld data set `data` and seam `seam`.
    pub(super) fn lines(self, data: usize, seam: usize) -> (Vec<String>, String) {
        let call = |word: &str| format!("ArcMainNG(#{word},WDAT{data},WP{seam})");
        let delay = |word: &str| format!("ArcGetDelay(#{word},WDAT{data})");
        let path = |word: &str| format!("PATH=ArcGetPath(#{word},WDAT{data})");
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
