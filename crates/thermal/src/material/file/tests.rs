//! What a material file says, and what of it is refused.

use super::*;

const TITANIUM: &str = meltpath_data::materials::TI6AL4V_EBM.text;

#[test]
fn everything_wrong_is_told_with_its_place() {
    let text = TITANIUM
        .replacen("unit = \"J/kg\"", "unit = \"kcal/kg\"", 1)
        .replacen("[solidus]", "[solidus]\ncolour = 1", 1)
        .replacen("value = 0.74", "value = \"74 %\"", 1);
    let mut mended = text.clone();
    let problems = read(&text, Readings::default()).unwrap_err().0;
    let told: Vec<&str> = problems
        .iter()
        .map(|p| &text[p.span.clone().unwrap()])
        .collect();
    assert_eq!(told, ["colour", "\"kcal/kg\"", "\"74 %\""], "{problems:?}");
    for problem in problems.iter().rev() {
        if let (Some(fix), Some(span)) = (&problem.fix, problem.span.clone()) {
            mended.replace_range(span, fix);
        }
    }
    let mended = mended
        .replacen("colour = 1\n", "", 1)
        .replacen("kcal/kg", "J/kg", 1);
    assert_eq!(
        read(&mended, Readings::default()).unwrap(),
        read(TITANIUM, Readings::default()).unwrap()
    );
}

#[test]
fn an_unlisted_source_is_refused() {
    let text = TITANIUM.replacen("source = \"iupac-2021\"", "source = \"iupac-2012\"", 1);
    let problems = read(&text, Readings::default()).unwrap_err().0;
    assert_eq!(problems.len(), 1);
    assert_eq!(&text[problems[0].span.clone().unwrap()], "\"iupac-2012\"");
    assert_eq!(problems[0].fix.as_deref(), Some("\"iupac-2021\""));
}

#[test]
fn laws_that_do_not_reach_the_melt_are_refused() {
    let text = TITANIUM.replacen("[750.0, 3000.0]", "[750.0, 1650.0]", 1);
    let error = read(&text, Readings::default()).unwrap_err().to_string();
    assert!(error.contains("above the liquidus, 1665 °C"), "{error}");
    assert_eq!(sources(TITANIUM).unwrap().len(), 8);
}

/// A metal that boils before it is molten is a slip of units; a pure one has a solidus all the same.
#[test]
fn what_boils_before_it_melts_is_refused() {
    let nickel = meltpath_data::materials::IN625_LASER.text;
    let told = |from: &str, to: &str| {
        let text = nickel.replacen(from, to, 1);
        read(&text, Readings::default()).unwrap_err().to_string()
    };
    let error = told("value = 2913.0", "value = 1173.0");
    assert!(error.contains("it boils at 1173 °C"), "{error}");
    let at = nickel.find("[solidus]").unwrap();
    let solidus = nickel[at..].lines().nth(1).unwrap();
    let at = nickel.find("[liquidus]").unwrap();
    let liquidus = nickel[at..].lines().nth(1).unwrap();
    let error = told(solidus, liquidus);
    assert!(error.contains("a solidus 1 K below it"), "{error}");
}

#[test]
fn readings_change_what_they_say() {
    let read = |readings| read(TITANIUM, readings).unwrap();
    let at = 750.0 + CELSIUS;
    let printed = read(Readings {
        porosity: PorosityReading::PrintedAsDensity,
        ..Readings::default()
    });
    assert!((printed.relative_density(at) - 0.3725).abs() < 1e-12);
    let swapped = read(Readings {
        density: DensityReading::Printed,
        ..Readings::default()
    });
    assert!(swapped.density(1700.0 + CELSIUS) > 4100.0);
    assert!((read(Readings::default()).density(at) - 4308.75).abs() < 1e-9);
}

/// Measured powder: its own value where it is fresh, the solid's where it is dense, straight in the density between.
#[test]
fn measured_powder_conducts_as_it_says() {
    let measured = Readings {
        powder: PowderReading::Measured,
        ..Readings::default()
    };
    let shipped = read(TITANIUM, measured).unwrap();
    let [fresh, dense] = shipped.powder_conduction()[..] else {
        panic!("{:?}", shipped.powder_conduction());
    };
    assert!((fresh[0] - 0.62).abs() < 1e-12 && dense == [1.0, 1.0]);
    let own = 1e3 * fresh[1] * shipped.conductivity(750.0 + CELSIUS);
    assert!((own - 2.0).abs() < 1e-9, "{own}");
    let corners = |corners: &str| TITANIUM.replace("[[750.0, 2.0]]", corners);
    let sintering = read(
        &corners("[[700.0, 1.0], [900.0, 2.0], [1200.0, 6.0]]"),
        measured,
    )
    .unwrap();
    let [first, second, third, last] = sintering.powder_conduction()[..] else {
        panic!("{:?}", sintering.powder_conduction());
    };
    // at 750 °C a quarter of the way from the first corner to the second
    assert!((1e3 * first[1] * sintering.conductivity(750.0 + CELSIUS) - 1.25).abs() < 1e-9);
    assert!(second[1] < third[1] && third[1] < last[1]);
    for (bad, said) in [
        ("[[750.0, 20.0]]", "no more than the solid's 16.4"),
        ("[[750.0, 0.0]]", "above zero"),
        ("[[900.0, 2.0], [750.0, 1.0]]", "must increase"),
    ] {
        let told = read(&corners(bad), measured).unwrap_err().to_string();
        assert!(told.contains(said), "{told}");
        // what is not asked for is not looked at
        read(&corners(bad), Readings::default()).unwrap();
    }
    let without = read(meltpath_data::materials::IN625_LASER.text, measured);
    let told = without.unwrap_err().to_string();
    assert!(told.contains("no [powder_conductivity]"), "{told}");
}

/// Densities in g/cm³ and conductivities per millimetre, as if they were in the units that the file names.
#[test]
fn slips_of_a_thousand_are_told() {
    let text = meltpath_data::materials::IN718_LASER.text;
    for (right, slip, said) in [
        ("[8170.0]", "[8.17]", "density is 8.17 kg/m³"),
        ("[30.0]", "[0.03]", "conductivity is 0.03 W/(m·K)"),
        ("[775.0]", "[0.775]", "specific_heat is 0.775 J/(kg·K)"),
    ] {
        assert!(text.contains(right), "{right}");
        let told = super::read(&text.replace(right, slip), Readings::default());
        let told = &told.unwrap_err().0[0];
        assert!(told.to_string().contains(said), "{told}");
        assert!(told.span.is_some(), "{told}");
    }
    let text = meltpath_data::materials::TI6AL4V_EBM.text;
    for (right, slip, said) in [
        ("value = 440.0e3", "value = 440.0", "latent is 440 J/kg"),
        (
            "[1.52, -1.56e-4]",
            "[1520.0, -0.156]",
            "surface_tension is 1520 N/m",
        ),
        (
            "value = 8.88e6",
            "value = 8.88e3",
            "the heat of evaporation of titanium is 8880 J/kg",
        ),
        (
            "value = 47.867e-3",
            "value = 47.867",
            "molar_mass of titanium is 47.9 kg/mol",
        ),
    ] {
        assert!(text.contains(right), "{right}");
        let told = super::read(&text.replace(right, slip), Readings::default());
        let told = &told.unwrap_err().0[0];
        assert!(told.to_string().contains(said), "{told}");
        assert!(told.span.is_some(), "{told}");
    }
}
