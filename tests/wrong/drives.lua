-- expect: 14: drives[1]: unknown coordinate "a_z"; did you mean "a_x"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 }, { "b", joint = "x", mass = 1 } },
  constraints = function(s)
    return {
      rd.lock { "b_x", 0 },
    }
  end,
  points = {
    E = "a",
  },
  drives = { "a_z" },
}
