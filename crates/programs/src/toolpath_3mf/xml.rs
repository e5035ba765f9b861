//! One XML element of a toolpath: its attributes by namespace, as numbers and words.

use meltpath_geometry::io::threemf::{CORE, PRODUCTION};
use quick_xml::XmlVersion;
use quick_xml::events::BytesStart;
use quick_xml::name::{Namespace, NamespaceResolver, ResolveResult};

use super::words::{DRAFT, NAMESPACE, TOOLPATH};

/// What is wrong with an element, and what to do.
#[derive(Debug)]
pub(super) enum Fault {
    /// It breaks the specification, or is not followed here.
    Broken(String, &'static str),
    /// It requires an extension that is not known here.
    Extension(String),
}

/// What to do about what breaks the specification.
pub(super) const EXPORT: &str = "export the package again, or correct it";

pub(super) fn broken(what: impl Into<String>) -> Fault {
    Fault::Broken(what.into(), EXPORT)
}

/// Whose words an element or an attribute is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Words<'a> {
    /// An attribute's that has no prefix: those of its element.
    Own,
    Core,
    Production,
    Toolpath,
    /// This project's.
    Ours,
    /// Somebody's.
    Other(&'a str),
}

pub(super) fn words<'a>(found: &ResolveResult<'a>) -> Result<Words<'a>, Fault> {
    match found {
        ResolveResult::Unbound => Ok(Words::Own),
        ResolveResult::Bound(Namespace(name)) => Ok(match *name {
            CORE => Words::Core,
            PRODUCTION => Words::Production,
            TOOLPATH | DRAFT => Words::Toolpath,
            NAMESPACE => Words::Ours,
            other => Words::Other(other),
        }),
        ResolveResult::Unknown(prefix) => Err(broken(format!(
            "the namespace prefix `{}` is not declared",
            String::from_utf8_lossy(prefix.as_bytes())
        ))),
    }
}

/// An element that begins.
pub(super) struct Start<'e, 'x> {
    pub(super) element: &'e BytesStart<'x>,
    pub(super) resolver: &'e NamespaceResolver,
}

impl Start<'_, '_> {
    pub(super) fn name(&self) -> String {
        self.element.local_name().as_ref().to_owned()
    }

    /// Goes through the attributes: whose, name, value.
    pub(super) fn each(
        &self,
        mut take: impl FnMut(Words<'_>, &str, &str) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        for attribute in self.element.attributes() {
            let attribute = attribute.map_err(|e| broken(e.to_string()))?;
            let key = attribute.key.as_ref();
            if key == "xmlns" || key.starts_with("xmlns:") || key.starts_with("xml:") {
                continue;
            }
            let (found, local) = self.resolver.resolve_attribute(attribute.key);
            let whose = words(&found)?;
            let value = attribute
                .normalized_value(XmlVersion::default())
                .map_err(|e| broken(e.to_string()))?;
            take(whose, local.as_ref(), &value)?;
        }
        Ok(())
    }

    /// The value of an attribute without prefix.
    pub(super) fn text(&self, name: &str) -> Result<Option<String>, Fault> {
        self.said(Words::Own, name)
    }

    /// The value of an attribute in the words of somebody.
    pub(super) fn said(&self, whose: Words<'_>, name: &str) -> Result<Option<String>, Fault> {
        let mut found = None;
        self.each(|w, key, value| {
            if w == whose && key == name {
                found = Some(value.to_owned());
            }
            Ok(())
        })?;
        Ok(found)
    }

    pub(super) fn required(&self, name: &str) -> Result<String, Fault> {
        let missing = || broken(format!("`{}` lacks the attribute `{name}`", self.name()));
        self.text(name)?.ok_or_else(missing)
    }

    /// A whole number from `least` to 2³¹−1.
    pub(super) fn count(&self, name: &str, least: u32) -> Result<u32, Fault> {
        count(name, &self.required(name)?, least)
    }
}

/// A whole number from `least` to 2³¹−1.
pub(super) fn count(name: &str, text: &str, least: u32) -> Result<u32, Fault> {
    let number = text.trim().parse::<u32>().ok();
    let number = number.filter(|n| (least..1 << 31).contains(n));
    number.ok_or_else(|| {
        broken(format!(
            "{name}=\"{text}\" is not a whole number from {least} to 2147483647"
        ))
    })
}

/// A whole number, positive or not.
pub(super) fn integer(name: &str, text: &str) -> Result<i32, Fault> {
    let number = text.trim().parse();
    number.map_err(|_| {
        broken(format!(
            "{name}=\"{text}\" is not a whole number from -2147483648 to 2147483647"
        ))
    })
}

/// A finite number.
pub(super) fn number(name: &str, text: &str) -> Result<f64, Fault> {
    let number = text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    number.ok_or_else(|| broken(format!("{name}=\"{text}\" is not a finite number")))
}

/// A number above zero, or from zero on.
pub(super) fn positive(name: &str, text: &str, with_zero: bool) -> Result<f64, Fault> {
    let value = number(name, text)?;
    if value > 0.0 || (with_zero && value == 0.0) {
        return Ok(value);
    }
    let wanted = if with_zero {
        "must not be negative"
    } else {
        "must be above zero"
    };
    Err(broken(format!("{name}=\"{text}\" {wanted}")))
}
