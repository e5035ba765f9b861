//! One XML element of a 3MF model: its attributes as numbers, names, transforms; what it may require of the reader.

use quick_xml::{
    XmlVersion,
    events::BytesStart,
    name::{Namespace, NamespaceResolver, ResolveResult},
};

use crate::math::{DAffine3, DMat3, DVec3};

/// Namespace of the core specification.
pub const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
/// Namespace of the production extension.
pub const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";
const SLICE: &str = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07";

/// Extensions that may be required without changing any shape, or whose effect is followed.
const HARMLESS: [&str; 5] = [
    CORE,
    PRODUCTION,
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
    // a path beside the shapes; what reads it is not here
    "http://schemas.3mf.io/3dmanufacturing/toolpath/2026/03",
];

/// Names of extensions that are refused when required, by a word of their namespace.
const REFUSED: [(&str, &str); 7] = [
    ("/slice/", "slice"),
    ("/beamlattice/", "beam lattice"),
    ("/securecontent/", "secure content (encrypted)"),
    ("/volumetric/", "volumetric"),
    ("/implicit/", "implicit"),
    ("/displacement/", "displacement"),
    ("/booleanoperations/", "boolean operations"),
];

/// What a build item or component places.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    /// Object identifier in its model part.
    pub(super) object: u32,
    /// Model part that holds it, if not the same.
    pub(super) path: Option<String>,
    /// From the object to its container.
    pub(super) transform: DAffine3,
    /// Whether a slicer's switch lets it be printed.
    pub(super) printable: bool,
}

/// What is wrong with an element.
#[derive(Debug)]
pub(super) enum Fault {
    Broken(String),
    Extension(String),
}

pub(super) fn broken(message: impl Into<String>) -> Fault {
    Fault::Broken(message.into())
}

/// The attributes of one element.
pub(super) struct Attributes<'e, 'x> {
    pub(super) element: &'e BytesStart<'x>,
    pub(super) resolver: &'e NamespaceResolver,
}

impl Attributes<'_, '_> {
    pub(super) fn text(&self, name: &str) -> Result<Option<String>, Fault> {
        let found = self
            .element
            .try_get_attribute(name)
            .map_err(|e| broken(e.to_string()))?;
        found
            .map(|a| {
                a.normalized_value(XmlVersion::default())
                    .map(std::borrow::Cow::into_owned)
                    .map_err(|e| broken(e.to_string()))
            })
            .transpose()
    }

    fn required(&self, name: &str) -> Result<String, Fault> {
        self.text(name)?.ok_or_else(|| {
            let element = self.element.local_name();
            broken(format!(
                "`{}` lacks the attribute `{name}`",
                element.as_ref()
            ))
        })
    }

    fn number<T: std::str::FromStr>(&self, name: &str, what: &str) -> Result<T, Fault> {
        let text = self.required(name)?;
        text.trim().parse().map_err(|_| {
            let element = self.element.local_name();
            broken(format!(
                "`{}` {name}=\"{text}\" is not {what}",
                element.as_ref()
            ))
        })
    }

    /// A resource identifier: 1 to 2³¹−1.
    pub(super) fn identifier(&self, name: &str) -> Result<u32, Fault> {
        let id: u32 = self.number(name, "a resource identifier")?;
        if id == 0 || id >= 1 << 31 {
            return Err(broken(format!(
                "{name}=\"{id}\" is not a resource identifier (1 to 2147483647)"
            )));
        }
        Ok(id)
    }

    /// Numbers of the attributes in `names`, in one walk over the element: the hot path of large meshes.
    pub(super) fn several<T: std::str::FromStr + Copy, const N: usize>(
        &self,
        names: [&str; N],
        what: &str,
    ) -> Result<[T; N], Fault> {
        let mut found = [None; N];
        for attribute in self.element.attributes() {
            let attribute = attribute.map_err(|e| broken(e.to_string()))?;
            if let Some(k) = names.iter().position(|n| attribute.key.as_ref() == *n) {
                let text = attribute.value.as_ref();
                found[k] = Some(
                    text.trim()
                        .parse()
                        .map_err(|_| broken(format!("`{}`=\"{text}\" is not {what}", names[k])))?,
                );
            }
        }
        let missing = |k: usize| broken(format!("the attribute `{}` is missing", names[k]));
        let mut values = Vec::with_capacity(N);
        for (k, value) in found.into_iter().enumerate() {
            values.push(value.ok_or_else(|| missing(k))?);
        }
        values.try_into().map_err(|_| missing(0))
    }

    /// The value of an extension's attribute.
    fn extension(&self, namespace: &str, name: &str) -> Result<Option<String>, Fault> {
        let mut found = None;
        for attribute in self.element.attributes() {
            let attribute = attribute.map_err(|e| broken(e.to_string()))?;
            let (bound, local) = self.resolver.resolve_attribute(attribute.key);
            if local.as_ref() == name
                && matches!(bound, ResolveResult::Bound(Namespace(n)) if n == namespace)
            {
                found = Some(attribute.value.into_owned());
            }
        }
        Ok(found)
    }

    /// Whether the object carries ready-made slices.
    ///
    /// Where they replace its mesh (`meshresolution="lowres"`) the mesh is only a placeholder: refused.
    pub(super) fn slices(&self) -> Result<bool, Fault> {
        if self.extension(SLICE, "meshresolution")?.as_deref() == Some("lowres") {
            return Err(Fault::Extension(
                "`slice` (its mesh is a placeholder)".to_owned(),
            ));
        }
        Ok(self.extension(SLICE, "slicestackid")?.is_some())
    }

    pub(super) fn placed(&self) -> Result<Placed, Fault> {
        let path = self
            .extension(PRODUCTION, "path")?
            .map(|path| path.trim_start_matches('/').to_owned());
        let transform = match self.text("transform")? {
            None => DAffine3::IDENTITY,
            Some(text) => transform(&text)?,
        };
        Ok(Placed {
            object: self.identifier("objectid")?,
            path,
            transform,
            printable: self.text("printable")?.as_deref() != Some("0"),
        })
    }
}

/// Twelve numbers of a 4 x 3 matrix applied to row vectors.
fn transform(text: &str) -> Result<DAffine3, Fault> {
    let numbers: Option<Vec<f64>> = text
        .split_ascii_whitespace()
        .map(|w| w.parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    let numbers: Option<[f64; 12]> = numbers.and_then(|n| n.try_into().ok());
    let Some(m) = numbers else {
        return Err(broken(format!(
            "transform=\"{text}\" is not twelve finite numbers"
        )));
    };
    let row = |k: usize| DVec3::new(m[3 * k], m[3 * k + 1], m[3 * k + 2]);
    let matrix = DMat3::from_cols(row(0), row(1), row(2));
    if matrix.determinant() == 0.0 {
        return Err(broken(format!("transform=\"{text}\" flattens the object")));
    }
    Ok(DAffine3::from_mat3_translation(matrix, row(3)))
}

/// One model unit in mm.
pub(super) fn unit(name: Option<&str>) -> Result<f64, Fault> {
    unit_in_mm(name).ok_or_else(|| {
        broken(format!(
            "unit=\"{}\" is none of micron, millimeter, centimeter, inch, foot, meter",
            name.unwrap_or_default()
        ))
    })
}

/// One unit of a model in mm, by the name that its `unit` says; millimetres where it says none.
pub fn unit_in_mm(name: Option<&str>) -> Option<f64> {
    Some(match name {
        None | Some("millimeter") => 1.0,
        Some("micron") => 1e-3,
        Some("centimeter") => 10.0,
        Some("inch") => 25.4,
        Some("foot") => 304.8,
        Some("meter") => 1000.0,
        Some(_) => return None,
    })
}

/// Refuses required extensions that would change shapes.
pub(super) fn required_extensions(attributes: &Attributes<'_, '_>) -> Result<(), Fault> {
    let required = attributes.text("requiredextensions")?.unwrap_or_default();
    for prefix in required.split_ascii_whitespace() {
        let Some(namespace) = attributes.text(&format!("xmlns:{prefix}"))? else {
            return Err(broken(format!(
                "the required extension prefix `{prefix}` is not declared"
            )));
        };
        if !HARMLESS.contains(&namespace.as_str()) {
            let known = REFUSED.iter().find(|(word, _)| namespace.contains(word));
            return Err(Fault::Extension(
                known.map_or(namespace.clone(), |(_, name)| format!("`{name}`")),
            ));
        }
    }
    Ok(())
}
