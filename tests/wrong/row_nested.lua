-- expect: 11: constraints[1][2]: a table; must be made by rd.position, velocity, acceleration, loop, parallel, perpendicular, on_line, on_plane, distance, orientation, close, drive, lock or contact
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      { rd.lock { "a_x", 1 }, { 7 } },
    }
  end,
}
