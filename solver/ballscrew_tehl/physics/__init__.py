"""One equation, one function: lubricant, Hertz contact, kinematics, closed film formulas, ball load distribution."""
