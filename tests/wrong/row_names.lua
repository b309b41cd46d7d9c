-- expect: 12: constraints[2].name: "lock a_x" is already taken in line 11; choose another name
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.lock { "a_x", 1 },
      rd.drive { "a_x", 1, name = "lock a_x" },
    }
  end,
}
