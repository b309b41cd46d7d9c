-- expect: 8: links[1].bodies[1].axis: "u" is not an axis; use x, y or z
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.cylinder { diameter = 0.1, length = 1, mass = 1, axis = "u" },
      } },
  },
}
