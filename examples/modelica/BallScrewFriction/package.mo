within ;
package BallScrewFriction "Friction of a preloaded ball screw at a rotational flange"
  import SI = Modelica.Units.SI;

  model ScrewFriction "Friction torque of the nut, from the map of thermal elastohydrodynamic solves"
    extends Interfaces.PartialScrewFriction(
      preslidingStiffness=Map.preslidingStiffness(map, stiffnessPreload, netSlidingCoefficient, breakawayFactor));
    parameter SI.Force stiffnessPreload(min=0) = 2000 "Preload that preslidingStiffness belongs to";
    parameter String fileName =
      Modelica.Utilities.Files.loadResource("modelica://BallScrewFriction/Resources/Data/nut_map.bin")
      "Map of the screw";
    parameter Real apparentViscosityRatio(min=0) = Map.apparentViscosityRatio(map)
      "Apparent over rheological viscosity in the torque, calibrated with the map";
    parameter Real netSlidingCoefficient(min=0) = Map.netSlidingCoefficient(map)
      "Net coefficient of sliding friction, calibrated with the map";
    parameter SI.Length roughnessHeight(min=0) = Map.roughnessHeight(map)
      "Roughness in the film of the viscous torque, calibrated with the map";
    parameter Real breakawayFactor(min=0) = Map.breakawayFactor(map)
      "Coulomb part at standstill over that in a full film; 1: off";
    final parameter Map.FrictionMap map = Map.FrictionMap(fileName);
    Real covered "1: the map covers the operating point; 0: inputs are clamped";
  equation
    coulomb = Map.coulombTorque(map, preload, w, T, axialLoad, netSlidingCoefficient, breakawayFactor);
    viscous = Map.viscousTorque(map, preload, w, T, axialLoad, apparentViscosityRatio, roughnessHeight);
    covered = Map.covered(map, preload, w, T, axialLoad);
    annotation (Documentation(info="<html><p>Compare BallScrewFrictionNative_fmi2.fmu in model exchange: same map, same C
functions, same law at standstill.</p></html>"));
  end ScrewFriction;

  model NutFriction "Friction torque of two nuts, each at its own force, from the same map"
    extends Interfaces.PartialNutFriction(
      preslidingStiffness=Map.preslidingStiffness(map, stiffnessPreload, netSlidingCoefficient, breakawayFactor));
    parameter SI.Force stiffnessPreload(min=0) = 2000 "Preload that preslidingStiffness belongs to";
    parameter String fileName =
      Modelica.Utilities.Files.loadResource("modelica://BallScrewFriction/Resources/Data/nut_map.bin")
      "Map of the screw";
    parameter Real apparentViscosityRatio(min=0) = Map.apparentViscosityRatio(map) "As in ScrewFriction";
    parameter Real netSlidingCoefficient(min=0) = Map.netSlidingCoefficient(map) "As in ScrewFriction";
    parameter SI.Length roughnessHeight(min=0) = Map.roughnessHeight(map) "As in ScrewFriction";
    parameter Real breakawayFactor(min=0) = Map.breakawayFactor(map) "As in ScrewFriction";
    final parameter Map.FrictionMap map = Map.FrictionMap(fileName);
  equation
    // the functions of the map give the torque of two equal nuts; not for oversize balls beyond separation, see the FMU
    coulomb = 0.5*(Map.coulombTorque(map, forceA, w, T, 0, netSlidingCoefficient, breakawayFactor)
      + Map.coulombTorque(map, forceB, w, T, 0, netSlidingCoefficient, breakawayFactor));
    viscous = 0.5*(Map.viscousTorque(map, forceA, w, T, 0, apparentViscosityRatio, roughnessHeight)
      + Map.viscousTorque(map, forceB, w, T, 0, apparentViscosityRatio, roughnessHeight));
  end NutFriction;

  model ScrewTransmission "Screw between a shaft and a nut: lead, Hertz contacts of the preloaded nut, friction"
    constant Real pi = Modelica.Constants.pi;
    parameter SI.Length lead(min=0) = 8e-3 "Travel of the nut in one turn";
    parameter SI.TranslationalSpringConstant nutStiffness(min=1) = 1.388871e9
      "Axial stiffness of the unloaded nut at nutStiffnessPreload: Hertz contacts between rigid bodies";
    parameter SI.Force nutStiffnessPreload(min=1e-3) = 2000 "Preload at which the nut has nutStiffness";
    parameter SI.Length axialPlay(min=0) = 0 "Free way of the nut while preload is 0";
    parameter SI.Time contactDampingTime(min=0) = 1e-5 "Damping of the contacts divided by their stiffness (assumed)";
    replaceable model Friction = NutFriction constrainedby Interfaces.PartialNutFriction;
    Friction friction;
    Modelica.Mechanics.Rotational.Interfaces.Flange_a flange_a "Left flange of the screw";
    Modelica.Mechanics.Translational.Interfaces.Flange_b nut "The nut, which moves along the screw";
    Modelica.Thermal.HeatTransfer.Interfaces.HeatPort_a heatPort "Oil at the inlet; takes all heat";
    Modelica.Blocks.Interfaces.RealInput preload(unit="N") "Preload of the nut without axial load";
    Modelica.Mechanics.Rotational.Sources.Torque load(useSupport=false) "Of the nut force on the shaft";
    Modelica.Mechanics.Translational.Sources.Force push(useSupport=false) "Of the screw on the nut";
    Interfaces.HeatSource damped "Heat of the damping";
    SI.Length x "Way by which the screw leads the nut";
    SI.Velocity rate "Of x";
    SI.Length preloaded "Approach of both nuts without load";
    SI.Force force "Of the screw on the nut";
    SI.Force damping "Part of it";
  protected
    final parameter Real k = nutStiffness/3*sqrt(nutStiffness/3/nutStiffnessPreload) "F = k d^1.5 of one nut, N and m";
  equation
    x = lead/(2*pi)*friction.flange_a.phi - nut.s;
    rate = lead/(2*pi)*friction.w - der(nut.s);
    preloaded = noEvent(if preload > 0 then (preload/k)^(2/3) else -axialPlay/2);
    friction.forceA = noEvent(if preloaded + x > 0 then k*(preloaded + x)*sqrt(preloaded + x) else 0);
    friction.forceB = noEvent(if preloaded - x > 0 then k*(preloaded - x)*sqrt(preloaded - x) else 0);
    damping = contactDampingTime*1.5*k*rate*(sqrt(noEvent(max(0, preloaded + x))) + sqrt(noEvent(max(0, preloaded - x))));
    force = friction.forceA - friction.forceB + damping;
    friction.preload = preload;
    friction.axialLoad = -force;
    load.tau = -lead/(2*pi)*force;
    push.f = force;
    damped.power = damping*rate;
    connect(flange_a, friction.flange_a);
    connect(friction.flange_b, load.flange);
    connect(push.flange, nut);
    connect(friction.heatPort, heatPort);
    connect(damped.port, heatPort);
    annotation (Documentation(info="<html><p>Compare BallScrewTransmission_fmi2.fmu in model exchange: same laws of the
contacts, friction of each nut at its own force.</p></html>"));
  end ScrewTransmission;

  package Interfaces "The law at standstill, without a map"
    partial model PartialScrewFriction "Coulomb torque through elasto-slip elements in parallel, and a viscous torque"
      constant Integer n = 6 "Elements, constants.h";
      parameter SI.RotationalSpringConstant preslidingStiffness(min=1e-6) = 150 "Of all elements at rest";
      parameter SI.RotationalDampingConstant preslidingDamping(min=0) = 0
        "Of all elements, of those that stick their share; explicit coupling needs it, equations do not";
      Modelica.Mechanics.Rotational.Interfaces.Flange_a flange_a "Left flange of the screw";
      Modelica.Mechanics.Rotational.Interfaces.Flange_b flange_b "Right flange of the screw";
      Modelica.Thermal.HeatTransfer.Interfaces.HeatPort_a heatPort "Oil at the inlet; takes the heat of friction";
      Modelica.Blocks.Interfaces.RealInput preload(unit="N") "Preload of the nut";
      Modelica.Blocks.Interfaces.RealInput axialLoad(unit="N")
        "On the nut body; positive loads the nut at whose flange it acts";
      SI.AngularVelocity w "Speed of the screw relative to the nut";
      SI.Temperature T "Of the oil";
      SI.Torque coulomb "Hysteresis and sliding part, magnitude";
      SI.Torque viscous "Viscous part, sign of the speed";
      SI.Torque tau "Friction torque; opposes motion: J*der(w) = drive - tau";
      SI.Torque presliding "Of the elements; not beyond coulomb";
      SI.Power lossPower "Heat; less than tau*w while the elements store energy";
      Element element[n](each root=root, each w=w, limit={(2*i - 1)*max(coulomb, 0)/(n*n*root) for i in 1:n})
        "Limits spread evenly; at them the torques add up to coulomb";
    protected
      final parameter Real root = sqrt(preslidingStiffness/n) "Of the stiffness of an element";
    equation
      flange_a.phi = flange_b.phi;
      w = der(flange_a.phi);
      0 = flange_a.tau + flange_b.tau - tau;
      T = heatPort.T;
      heatPort.Q_flow = -lossPower;
      // Al-Bender, Swevers, IEEE Control Syst. Mag. 28 (2008) 64; Iwan, J. Appl. Mech. 33 (1966) 893
      presliding = max(-coulomb, min(coulomb, sum(element.tau) + preslidingDamping*w*sum(element.sticks)/n));
      tau = viscous + presliding;
      lossPower = viscous*w + max(0, presliding*w - sum(element.storedPower));
    end PartialScrewFriction;

    model Element "A spring with a slider in series, which slides where y reaches its limit"
      parameter Real root "Of the stiffness";
      input SI.AngularVelocity w "Speed of the screw";
      input Real limit(unit="rad") "Of y";
      Real y(start=0, fixed=true, unit="rad") "Deflection times root; half the square is the energy in J";
      SI.Torque tau "Not beyond root*limit";
      SI.Power storedPower "Rate of the energy";
      Real sticks "1: follows the motion; 0: slides";
      Integer slip(start=0, fixed=true) "0: sticks; +1, -1: slides that way";
      discrete SI.Energy eventHeat(start=0, fixed=true) "Lost at events, at which a power has no time";
    protected
      constant Real levelMargin = 0.05 "Of y above a limit that has fallen, constants.h";
      constant SI.Time followTime = 2e-3 "In which y follows the limit while it slides, constants.h";
      constant SI.AngularVelocity turning = 1e-6 "Hysteresis of a reversal, model.c";
      Real held(unit="rad") "y, not beyond limit";
      Real rate(unit="rad/s") "Of y";
      Boolean forward "Begins to slide forward";
      Boolean backward "Begins to slide backward";
      Boolean turned "Speed has turned while it slid";
      Boolean fallen "Limit has fallen below y";
    equation
      sticks = if slip == 0 then 1 else 0;
      rate = if slip == 0 then root*w else slip*max(-root*abs(w), min(root*abs(w), (limit - slip*y)/followTime));
      der(y) = rate;
      held = max(-limit, min(limit, y));
      tau = root*(if slip == 0 then held else slip*min(limit, slip*y + followTime*root*abs(w)));
      storedPower = rate*y;
      forward = pre(slip) == 0 and w > 0 and y > limit;
      backward = pre(slip) == 0 and w < 0 and y < -limit;
      turned = pre(slip) == 1 and w < -turning or pre(slip) == -1 and w > turning;
      fallen = pre(slip) == 0 and (y > (1 + levelMargin)*limit or y < -(1 + levelMargin)*limit);
      when forward then
        slip = 1;
      elsewhen backward then
        slip = -1;
      elsewhen turned then
        slip = 0;
      end when;
      when turned or fallen then
        eventHeat = pre(eventHeat) + (y*y - held*held)/2;
        reinit(y, held);
      end when;
    end Element;

    partial model PartialNutFriction "The same with the forces of both nuts"
      extends PartialScrewFriction;
      Modelica.Blocks.Interfaces.RealInput forceA(unit="N") "Of the nut that a positive force on the nut loads";
      Modelica.Blocks.Interfaces.RealInput forceB(unit="N") "Of the other nut";
    end PartialNutFriction;

    model HeatSource "A heat flow out of the component"
      Modelica.Thermal.HeatTransfer.Interfaces.HeatPort_a port;
      SI.Power power "Into the port's connection";
    equation
      port.Q_flow = -power;
    end HeatSource;
  end Interfaces;

  package Map "The map in C: the functions that the native FMUs use"
    class FrictionMap "A map that is read once, with what the last call left to reuse"
      extends ExternalObject;

      function constructor "Stops with a message if the file is missing, damaged or of another version"
        input String fileName;
        output FrictionMap map;
        external "C" map = ballScrewMap_open(fileName) annotation (
          Include="#include \"BallScrewFriction.h\"",
          IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
          Library="BallScrewFriction",
          LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
      end constructor;

      function destructor
        input FrictionMap map;
        external "C" ballScrewMap_close(map) annotation (
          Include="#include \"BallScrewFriction.h\"",
          IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
          Library="BallScrewFriction",
          LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
      end destructor;
    end FrictionMap;

    pure function coulombTorque "Magnitude of hysteresis and sliding part, both nuts"
      input FrictionMap map;
      input SI.Force preload;
      input SI.AngularVelocity w;
      input SI.Temperature T;
      input SI.Force axialLoad;
      input Real netSlidingCoefficient;
      input Real breakawayFactor;
      output SI.Torque coulomb;
      external "C" coulomb = ballScrewMap_coulomb(map, preload, w, T, axialLoad, netSlidingCoefficient,
        breakawayFactor) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
      annotation (derivative(zeroDerivative=netSlidingCoefficient, zeroDerivative=breakawayFactor) =
        coulombTorque_der);
    end coulombTorque;

    pure function coulombTorque_der "Its rate, analytic"
      input FrictionMap map;
      input SI.Force preload;
      input SI.AngularVelocity w;
      input SI.Temperature T;
      input SI.Force axialLoad;
      input Real netSlidingCoefficient;
      input Real breakawayFactor;
      input Real der_preload(unit="N/s");
      input SI.AngularAcceleration der_w;
      input Real der_T(unit="K/s");
      input Real der_axialLoad(unit="N/s");
      output Real der_coulomb(unit="N.m/s");
      external "C" der_coulomb = ballScrewMap_coulombRate(map, preload, w, T, axialLoad, netSlidingCoefficient,
        breakawayFactor, der_preload, der_w, der_T, der_axialLoad) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end coulombTorque_der;

    pure function viscousTorque "Viscous part, both nuts, with the sign of the speed"
      input FrictionMap map;
      input SI.Force preload;
      input SI.AngularVelocity w;
      input SI.Temperature T;
      input SI.Force axialLoad;
      input Real apparentViscosityRatio;
      input SI.Length roughnessHeight;
      output SI.Torque viscous;
      external "C" viscous = ballScrewMap_viscous(map, preload, w, T, axialLoad, apparentViscosityRatio,
        roughnessHeight) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
      annotation (derivative(zeroDerivative=apparentViscosityRatio, zeroDerivative=roughnessHeight) =
        viscousTorque_der);
    end viscousTorque;

    pure function viscousTorque_der "Its rate, analytic"
      input FrictionMap map;
      input SI.Force preload;
      input SI.AngularVelocity w;
      input SI.Temperature T;
      input SI.Force axialLoad;
      input Real apparentViscosityRatio;
      input SI.Length roughnessHeight;
      input Real der_preload(unit="N/s");
      input SI.AngularAcceleration der_w;
      input Real der_T(unit="K/s");
      input Real der_axialLoad(unit="N/s");
      output Real der_viscous(unit="N.m/s");
      external "C" der_viscous = ballScrewMap_viscousRate(map, preload, w, T, axialLoad, apparentViscosityRatio,
        roughnessHeight, der_preload, der_w, der_T, der_axialLoad) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end viscousTorque_der;

    pure function covered "Whether the map covers the point; a number, since no Boolean may follow from continuous
      inputs"
      input FrictionMap map;
      input SI.Force preload;
      input SI.AngularVelocity w;
      input SI.Temperature T;
      input SI.Force axialLoad;
      output Real inside "1: it does; 0: inputs are clamped";
      external "C" inside = ballScrewMap_covered(map, preload, w, T, axialLoad) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end covered;

    pure function films "Thinnest film, largest temperature rise and pressure over all balls"
      input FrictionMap map;
      input SI.Force preload;
      input SI.AngularVelocity w;
      input SI.Temperature T;
      input SI.Force axialLoad;
      output SI.Length filmThicknessMin;
      output SI.TemperatureDifference filmTemperatureRise;
      output SI.Pressure contactPressureMax;
      external "C" ballScrewMap_films(map, preload, w, T, axialLoad, filmThicknessMin, filmTemperatureRise,
        contactPressureMax) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end films;

    pure function apparentViscosityRatio "As calibrated with the map"
      input FrictionMap map;
      output Real ratio;
      external "C" ratio = ballScrewMap_apparentViscosityRatio(map) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end apparentViscosityRatio;

    pure function netSlidingCoefficient "As calibrated with the map"
      input FrictionMap map;
      output Real coefficient;
      external "C" coefficient = ballScrewMap_netSlidingCoefficient(map) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end netSlidingCoefficient;

    pure function roughnessHeight "As calibrated with the map"
      input FrictionMap map;
      output SI.Length height;
      external "C" height = ballScrewMap_roughnessHeight(map) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end roughnessHeight;

    pure function breakawayFactor "As stored with the map"
      input FrictionMap map;
      output Real factor;
      external "C" factor = ballScrewMap_breakawayFactor(map) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end breakawayFactor;

    pure function preslidingStiffness "From contact width and Coulomb torque of the screw"
      input FrictionMap map;
      input SI.Force preload;
      input Real netSlidingCoefficient;
      input Real breakawayFactor;
      output SI.RotationalSpringConstant stiffness;
      external "C" stiffness = ballScrewMap_preslidingStiffness(map, preload, netSlidingCoefficient,
        breakawayFactor) annotation (
        Include="#include \"BallScrewFriction.h\"",
        IncludeDirectory="modelica://BallScrewFriction/Resources/Include",
        Library="BallScrewFriction",
        LibraryDirectory="modelica://BallScrewFriction/Resources/Library");
    end preslidingStiffness;
  end Map;

  package Examples
    model Axis "One axis of a circle: P-PI cascade, current loop, motor and screw, table on a spring"
      // the values of examples/servo_axis.py
      constant Real pi = Modelica.Constants.pi;
      parameter SI.Length lead = 8e-3;
      parameter SI.Force preload = 2000;
      parameter Real positionGain(unit="1/s") = 25;
      parameter Real speedGain(unit="N.m.s/rad") = 1.5;
      parameter SI.Time resetTime = 10e-3;
      parameter SI.AngularVelocity currentBandwidth = 2500;
      parameter SI.Length radius = 10e-3;
      parameter SI.Velocity feed = 0.02;
      parameter SI.Force cuttingForce = 300 "Along the path, against the motion";
      replaceable model Friction = ScrewFriction constrainedby Interfaces.PartialScrewFriction;
      Friction friction(preslidingStiffness=150);
      Modelica.Mechanics.Rotational.Sources.Torque motor(useSupport=false);
      Modelica.Mechanics.Rotational.Components.Inertia screw(J=5e-3, phi(start=0, fixed=true), w(start=0, fixed=true))
        "Motor, coupling and screw";
      Modelica.Mechanics.Rotational.Components.IdealGearR2T thread(ratio=2*pi/lead, useSupportR=false, useSupportT=false);
      Modelica.Mechanics.Translational.Components.SpringDamper axial(c=1.5e8, d=2e4);
      Modelica.Mechanics.Translational.Components.Mass table(m=300, s(start=0, fixed=true), v(start=0, fixed=true));
      Modelica.Mechanics.Translational.Components.Damper guide(d=400);
      Modelica.Mechanics.Translational.Components.Fixed bed;
      Modelica.Mechanics.Translational.Sources.Force process(useSupport=false);
      Modelica.Thermal.HeatTransfer.Sources.FixedTemperature oil(T=303.15);
      SI.Position reference "Of the table";
      SI.Velocity referenceVelocity;
      SI.Position error "Following error";
      SI.AngularVelocity speedError;
      SI.Torque wanted "Of the speed loop";
      Real integral(start=0, fixed=true, unit="rad/s");
      SI.Torque motorTorque(start=0, fixed=true) "The current loop is a lag of first order";
    equation
      reference = radius*(1 - cos(feed/radius*time));
      referenceVelocity = feed*sin(feed/radius*time);
      error = reference - table.s;
      speedError = (positionGain*error + referenceVelocity)*2*pi/lead - screw.w;
      der(integral) = speedError/resetTime;
      wanted = speedGain*(speedError + integral);
      der(motorTorque) = currentBandwidth*(wanted - motorTorque);
      motor.tau = motorTorque;
      process.f = -cuttingForce*sin(feed/radius*time);
      friction.preload = preload;
      friction.axialLoad = axial.f "The table pushes back on the nut";
      connect(motor.flange, screw.flange_a);
      connect(screw.flange_b, friction.flange_a);
      connect(friction.flange_b, thread.flangeR);
      connect(thread.flangeT, axial.flange_a);
      connect(axial.flange_b, table.flange_a);
      connect(table.flange_b, guide.flange_a);
      connect(guide.flange_b, bed.flange);
      connect(process.flange, table.flange_b);
      connect(friction.heatPort, oil.port);
      annotation (experiment(StopTime=2.1, Tolerance=1e-7));
    end Axis;

    model TransmissionAxis "The mechanics of Axis with ScrewTransmission, driven by a torque"
      replaceable model Friction = NutFriction constrainedby Interfaces.PartialNutFriction;
      parameter SI.Torque amplitude = 2 "Of the motor";
      parameter Real frequency(unit="Hz") = 5 "Of the motor";
      parameter SI.Force preload = 2000;
      ScrewTransmission transmission(redeclare model Friction = Friction);
      Modelica.Mechanics.Rotational.Sources.Torque motor(useSupport=false);
      Modelica.Mechanics.Rotational.Components.Inertia screw(J=5e-3, phi(start=0, fixed=true), w(start=0, fixed=true))
        "Motor, coupling and screw";
      Modelica.Mechanics.Translational.Components.Mass nutBody(m=10, s(start=0, fixed=true), v(start=0, fixed=true));
      Modelica.Mechanics.Translational.Components.SpringDamper axial(c=1.68e8, d=2e4)
        "Shaft of the screw and bearings: with the nut in series that of Axis";
      Modelica.Mechanics.Translational.Components.Mass table(m=300, s(start=0, fixed=true), v(start=0, fixed=true));
      Modelica.Mechanics.Translational.Components.Damper guide(d=400);
      Modelica.Mechanics.Translational.Components.Fixed bed;
      Modelica.Thermal.HeatTransfer.Sources.FixedTemperature oil(T=303.15);
    equation
      motor.tau = amplitude*sin(2*Modelica.Constants.pi*frequency*time);
      transmission.preload = preload;
      connect(motor.flange, screw.flange_a);
      connect(screw.flange_b, transmission.flange_a);
      connect(transmission.nut, nutBody.flange_a);
      connect(nutBody.flange_b, axial.flange_a);
      connect(axial.flange_b, table.flange_a);
      connect(table.flange_b, guide.flange_a);
      connect(guide.flange_b, bed.flange);
      connect(transmission.heatPort, oil.port);
      annotation (experiment(StopTime=0.4, Tolerance=1e-7));
    end TransmissionAxis;
  end Examples;
  annotation (version="0.1.0", uses(Modelica(version="4.0.0")), Documentation(info="<html>
<p>Checked by parsing, by running law and axis in rumoca with stand-ins for the map and the standard library, and by
running the external functions from C. Not yet loaded in a Modelica tool with external functions.</p></html>"));
end BallScrewFriction;
