-- expect: 6: drives[2]: b_x is locked (rd.lock), so that a drive has no effect on it; remove one of them
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = { { "a", joint = "x", mass = 1 }, { "b", joint = "x", mass = 1 } },
  drives = { "a_x", "b_x" },
  constraints = function() return { rd.lock { "b_x", 0 } } end,
}
