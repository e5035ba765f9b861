//! What holds where a file says nothing, of another text.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// What holds where a file says nothing: another text, which a value of the file stands for.
#[derive(Debug, Clone)]
pub struct Under<'a> {
    /// The text; of sound TOML, else nothing of it is taken.
    pub text: &'a str,
    /// Where the file names it: the place of all that is taken.
    pub span: Range<usize>,
    /// Tables of which keys are taken one by one, where the file has the table, too.
    pub mixed: &'a [&'a str],
}

impl<'a> Under<'a> {
    /// Puts what a table lacks into it.
    pub(super) fn fill(&self, table: &mut DeTable<'a>) {
        if let Ok(from) = DeTable::parse(self.text) {
            fill(table, from.into_inner(), &self.span, self.mixed);
        }
    }
}

/// Puts what a table lacks into it, at one place; into tables of these names key by key.
fn fill<'a>(table: &mut DeTable<'a>, from: DeTable<'a>, place: &Range<usize>, mixed: &[&str]) {
    for (key, value) in from {
        let name = key.get_ref().as_ref();
        match (table.get_mut(name), value.into_inner()) {
            (None, value) => {
                let key = toml::Spanned::new(place.clone(), key.into_inner());
                table.insert(key, moved(value, place));
            }
            (Some(own), DeValue::Table(more)) if mixed.contains(&name) => {
                if let DeValue::Table(own) = own.get_mut() {
                    fill(own, more, place, &[]);
                }
            }
            (Some(_), _) => {}
        }
    }
}

/// A value with all that is in it, at one place.
fn moved<'a>(value: DeValue<'a>, place: &Range<usize>) -> toml::Spanned<DeValue<'a>> {
    let value = match value {
        DeValue::Array(list) => {
            let moved = list.into_iter().map(|v| moved(v.into_inner(), place));
            DeValue::Array(moved.collect())
        }
        DeValue::Table(table) => {
            let mut all = DeTable::new();
            fill(&mut all, table, place, &[]);
            DeValue::Table(all)
        }
        other => other,
    };
    toml::Spanned::new(place.clone(), value)
}
