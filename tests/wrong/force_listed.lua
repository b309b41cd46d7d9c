-- expect: 13: forces[1]: a table; must be COORDINATE = value, or made by rd.spring, damper, actuator, force, torque or energy
-- expect: 14: forces[2]: made by rd.loop; must be COORDINATE = value, or made by rd.spring, damper, actuator, force, torque or energy
-- expect: 15: forces[3]: a number; must be COORDINATE = value, or made by rd.spring, damper, actuator, force, torque or energy
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  forces = function(s)
    return {
      { a_x = 1 },
      rd.loop { "E", "ground" },
      5,
    }
  end,
}
