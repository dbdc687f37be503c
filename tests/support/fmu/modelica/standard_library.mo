within ;
package Modelica "Stand-ins for the classes of the Modelica Standard Library 4.0 that BallScrewFriction uses: names, connectors
  and equations, nothing else. For tests only."
  package Constants
    final constant Real pi = 3.14159265358979323846;
  end Constants;
  package Utilities
    package Files
      function loadResource
        input String uri;
        output String fileName;
      algorithm
        fileName := uri;
      end loadResource;
    end Files;
  end Utilities;
  package Units
    package SI
      type Angle = Real(final quantity="Angle", final unit="rad");
      type AngularVelocity = Real(final quantity="AngularVelocity", final unit="rad/s");
      type AngularAcceleration = Real(final quantity="AngularAcceleration", final unit="rad/s2");
      type Length = Real(final quantity="Length", final unit="m");
      type Position = Length;
      type Velocity = Real(final quantity="Velocity", final unit="m/s");
      type Acceleration = Real(final quantity="Acceleration", final unit="m/s2");
      type Mass = Real(final quantity="Mass", final unit="kg");
      type Force = Real(final quantity="Force", final unit="N");
      type Torque = Real(final quantity="Torque", final unit="N.m");
      type Inertia = Real(final quantity="MomentOfInertia", final unit="kg.m2");
      type Power = Real(final quantity="Power", final unit="W");
      type Energy = Real(final quantity="Energy", final unit="J");
      type HeatFlowRate = Real(final quantity="Power", final unit="W");
      type Pressure = Real(final quantity="Pressure", final unit="Pa");
      type Temperature = Real(final quantity="ThermodynamicTemperature", final unit="K");
      type TemperatureDifference = Real(final quantity="ThermodynamicTemperature", final unit="K");
      type Time = Real(final quantity="Time", final unit="s");
      type RotationalSpringConstant = Real(final quantity="RotationalSpringConstant", final unit="N.m/rad");
      type RotationalDampingConstant = Real(final quantity="RotationalDampingConstant", final unit="N.m.s/rad");
      type TranslationalSpringConstant = Real(final quantity="TranslationalSpringConstant", final unit="N/m");
      type TranslationalDampingConstant = Real(final quantity="TranslationalDampingConstant", final unit="N.s/m");
    end SI;
  end Units;
  package Blocks
    package Interfaces
      connector RealInput = input Real;
    end Interfaces;
  end Blocks;
  package Thermal
    package HeatTransfer
      package Interfaces
        connector HeatPort_a
          Modelica.Units.SI.Temperature T;
          flow Modelica.Units.SI.HeatFlowRate Q_flow;
        end HeatPort_a;
        connector HeatPort_b
          Modelica.Units.SI.Temperature T;
          flow Modelica.Units.SI.HeatFlowRate Q_flow;
        end HeatPort_b;
      end Interfaces;
      package Sources
        model FixedTemperature
          parameter Modelica.Units.SI.Temperature T;
          Interfaces.HeatPort_b port;
        equation
          port.T = T;
        end FixedTemperature;
      end Sources;
    end HeatTransfer;
  end Thermal;
  package Mechanics
    package Rotational
      package Interfaces
        connector Flange_a
          Modelica.Units.SI.Angle phi;
          flow Modelica.Units.SI.Torque tau;
        end Flange_a;
        connector Flange_b
          Modelica.Units.SI.Angle phi;
          flow Modelica.Units.SI.Torque tau;
        end Flange_b;
      end Interfaces;
      package Components
        model Inertia
          parameter Modelica.Units.SI.Inertia J(min=0);
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
          Modelica.Units.SI.Angle phi;
          Modelica.Units.SI.AngularVelocity w;
          Modelica.Units.SI.AngularAcceleration a;
        equation
          phi = flange_a.phi;
          phi = flange_b.phi;
          w = der(phi);
          a = der(w);
          J*a = flange_a.tau + flange_b.tau;
        end Inertia;
        model IdealGearR2T
          parameter Boolean useSupportR = false;
          parameter Boolean useSupportT = false;
          parameter Real ratio(final unit="rad/m", start=1);
          Interfaces.Flange_a flangeR;
          Translational.Interfaces.Flange_b flangeT;
        equation
          flangeT.s = flangeR.phi/ratio; // solved for s: rumoca does not differentiate ratio*s
          0 = ratio*flangeR.tau + flangeT.f;
        end IdealGearR2T;
      end Components;
      package Sources
        model Torque
          parameter Boolean useSupport = false;
          Modelica.Blocks.Interfaces.RealInput tau;
          Interfaces.Flange_b flange;
        equation
          flange.tau = -tau;
        end Torque;
      end Sources;
    end Rotational;
    package Translational
      package Interfaces
        connector Flange_a
          Modelica.Units.SI.Position s;
          flow Modelica.Units.SI.Force f;
        end Flange_a;
        connector Flange_b
          Modelica.Units.SI.Position s;
          flow Modelica.Units.SI.Force f;
        end Flange_b;
      end Interfaces;
      package Components
        model Fixed
          parameter Modelica.Units.SI.Position s0 = 0;
          Interfaces.Flange_b flange;
        equation
          flange.s = s0;
        end Fixed;
        model Mass
          parameter Modelica.Units.SI.Mass m(min=0);
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
          Modelica.Units.SI.Position s;
          Modelica.Units.SI.Velocity v;
          Modelica.Units.SI.Acceleration a;
        equation
          flange_a.s = s;
          flange_b.s = s;
          v = der(s);
          a = der(v);
          m*a = flange_a.f + flange_b.f;
        end Mass;
        model SpringDamper
          parameter Modelica.Units.SI.TranslationalSpringConstant c(min=0);
          parameter Modelica.Units.SI.TranslationalDampingConstant d(min=0);
          parameter Modelica.Units.SI.Position s_rel0 = 0;
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
          Modelica.Units.SI.Position s_rel;
          Modelica.Units.SI.Velocity v_rel;
          Modelica.Units.SI.Force f;
        equation
          s_rel = flange_b.s - flange_a.s;
          v_rel = der(s_rel);
          f = c*(s_rel - s_rel0) + d*v_rel;
          flange_b.f = f;
          flange_a.f = -f;
        end SpringDamper;
        model Damper
          parameter Modelica.Units.SI.TranslationalDampingConstant d(min=0);
          Interfaces.Flange_a flange_a;
          Interfaces.Flange_b flange_b;
          Modelica.Units.SI.Position s_rel;
          Modelica.Units.SI.Velocity v_rel;
          Modelica.Units.SI.Force f;
        equation
          s_rel = flange_b.s - flange_a.s;
          v_rel = der(s_rel);
          f = d*v_rel;
          flange_b.f = f;
          flange_a.f = -f;
        end Damper;
      end Components;
      package Sources
        model Force
          parameter Boolean useSupport = false;
          Modelica.Blocks.Interfaces.RealInput f;
          Interfaces.Flange_b flange;
        equation
          flange.f = -f;
        end Force;
      end Sources;
    end Translational;
  end Mechanics;
end Modelica;
