//! The quantities of a head's data files.

use meltpath_base::quantity;

quantity!(
    /// A frequency, Hz inside.
    Hertz, "frequency", "Hz",
    [("Hz", 1.0), ("kHz", 1e3)]
);
quantity!(
    /// A resistance, Ω inside.
    Resistance, "resistance", "Ω",
    [("Ω", 1.0)]
);
quantity!(
    /// An inductance, H inside.
    Inductance, "inductance", "H",
    [("µH", 1e-6), ("H", 1.0)]
);
quantity!(
    /// A torque per current, N·m/A inside.
    TorqueConstant, "torque constant", "N·m/A",
    [("N·m/A", 1.0)]
);
quantity!(
    /// A voltage per speed of turning, V·s/rad inside.
    BackEmf, "back-EMF constant", "V·s/rad",
    [("V·s/rad", 1.0)]
);
quantity!(
    /// A moment of inertia, kg·m² inside.
    Inertia, "inertia", "kg·m²",
    [("kg·m²", 1.0), ("g·cm²", 1e-7)]
);
quantity!(
    /// A torque per speed of turning, N·m·s/rad inside.
    Viscous, "viscous coefficient", "N·m·s/rad",
    [("N·m·s/rad", 1.0)]
);
quantity!(
    /// A torque per angle, N·m/rad inside.
    Stiffness, "stiffness", "N·m/rad",
    [("N·m/rad", 1.0)]
);
quantity!(
    /// A torque, N·m inside.
    Torque, "torque", "N·m",
    [("N·m", 1.0), ("µN·m", 1e-6)]
);
quantity!(
    /// A gain of the current loop, V/A inside.
    CurrentGain, "gain", "V/A",
    [("V/A", 1.0)]
);
quantity!(
    /// A gain of the speed loop, A·s/deg inside.
    SpeedGain, "gain", "A·s/deg",
    [("A·s/deg", 1.0)]
);
quantity!(
    /// A gain of the position loop, 1/s inside.
    Rate, "gain", "1/s",
    [("1/s", 1.0)]
);
quantity!(
    /// An acceleration of the spot, mm/s² inside.
    SpotAcceleration, "acceleration", "m/s²",
    [("m/s²", 1e3), ("mm/s²", 1.0)]
);
quantity!(
    /// A power, W inside.
    Power, "power", "W",
    [("W", 1.0)]
);
