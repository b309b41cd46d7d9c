-- expect: 14: forces[1]: made by rd.position; must be COORDINATE = value, or made by rd.spring, damper, actuator, force, torque or energy
-- expect: 15: forces[2]: made by rd.box; must be COORDINATE = value, or made by rd.spring, damper, actuator, force, torque or energy
-- expect: 20: constraints[1]: made by rd.spring; must be made by rd.position, velocity, acceleration, loop, parallel, perpendicular, on_line, on_plane, distance, orientation, close, drive, lock or contact
-- expect: 21: constraints[2].line: made by rd.loop; must be an axis such as { "arm", "z" }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s)
    return {
      rd.position { s.q.arm_z },
      rd.box { { 1, 1, 1 }, mass = 1 },
    }
  end,
  constraints = function(s)
    return {
      rd.spring { "ground", "arm", stiffness = 1 },
      rd.on_line { "arm", rd.loop { "arm", "hand" } },
    }
  end,
}
