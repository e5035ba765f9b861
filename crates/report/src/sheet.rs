//! The operator sheet: what a person sets, does and checks at the machine. Prints on its own.

use std::fmt::Write as _;

use crate::escape::escape;
use crate::table::Table;

/// A setting to make before starting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// What is set, such as `wire`.
    pub name: String,
    /// To what, with its unit.
    pub value: String,
    /// Where or why; empty for none.
    pub remark: String,
}

impl Setting {
    /// A setting with a remark, which may be empty.
    pub fn new(name: &str, value: &str, remark: &str) -> Self {
        Setting {
            name: name.to_owned(),
            value: value.to_owned(),
            remark: remark.to_owned(),
        }
    }
}

/// The sheet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OperatorSheet {
    /// Settings of the source, the gas, the wire, the frames.
    pub settings: Vec<Setting>,
    /// What to tick before the start.
    pub before: Vec<String>,
    /// The order of layers or passes with their pauses.
    pub order: Table,
    /// What to watch and to tick during and after.
    pub during: Vec<String>,
}

impl OperatorSheet {
    /// The sheet as HTML.
    pub fn to_html(&self) -> String {
        let mut html = String::new();
        // writing to a String cannot fail, here and below
        if !self.settings.is_empty() {
            html.push_str("<h3>Set</h3><dl class=\"settings\">");
            for s in &self.settings {
                let _ = write!(
                    html,
                    "<div><dt>{}</dt><dd><b>{}</b>",
                    escape(&s.name),
                    escape(&s.value)
                );
                if !s.remark.is_empty() {
                    let _ = write!(html, " <span class=\"note\">{}</span>", escape(&s.remark));
                }
                html.push_str("</dd></div>");
            }
            html.push_str("</dl>");
        }
        list(&mut html, "Before the start", &self.before);
        if !self.order.columns.is_empty() {
            html.push_str(&self.order.to_html());
        }
        list(&mut html, "During and after", &self.during);
        html.push_str(
            "<dl class=\"sign\"><div><dt>Operator</dt></div><div><dt>Date</dt></div><div><dt>Part number</dt></div></dl>",
        );
        html
    }
}

fn list(html: &mut String, title: &str, items: &[String]) {
    if items.is_empty() {
        return;
    }
    let _ = write!(html, "<h3>{title}</h3><ul class=\"tick\">");
    for item in items {
        let _ = write!(
            html,
            "<li><label><input type=\"checkbox\"> <span>{}</span></label></li>",
            escape(item)
        );
    }
    html.push_str("</ul>");
}
