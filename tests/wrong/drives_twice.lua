-- expect: 6: drives[2]: "a_x" is given twice; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = { { "a", joint = "x", mass = 1 } },
  drives = { "a_x", "a_x" },
}
