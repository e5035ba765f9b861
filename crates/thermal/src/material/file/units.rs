//! Units of the numbers in material files.

use meltpath_base::quantity;

quantity!(
    /// A specific heat, J/(kg·K) inside.
    SpecificHeat, "specific heat", "J/(kg·K)",
    [("J/(kg·K)", 1.0)]
);
quantity!(
    /// A thermal conductivity, W/(m·K) inside.
    Conductivity, "thermal conductivity", "W/(m·K)",
    [("W/(m·K)", 1.0)]
);
quantity!(
    /// An energy per mass, J/kg inside.
    SpecificEnergy, "energy per mass", "J/kg",
    [("J/kg", 1.0), ("kJ/kg", 1e3)]
);
quantity!(
    /// A molar mass, kg/mol inside.
    MolarMass, "molar mass", "kg/mol",
    [("kg/mol", 1.0), ("g/mol", 1e-3)]
);
quantity!(
    /// An energy per amount of substance, J/mol inside.
    MolarEnergy, "energy per mole", "J/mol",
    [("J/mol", 1.0), ("kJ/mol", 1e3)]
);
quantity!(
    /// A surface tension, N/m inside.
    Tension, "surface tension", "N/m",
    [("N/m", 1.0), ("mN/m", 1e-3)]
);
quantity!(
    /// A roughness, µm inside.
    Ra, "roughness", "µm",
    [("µm", 1.0)]
);
