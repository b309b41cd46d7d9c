-- expect: 7: links[1].at[2]: value nan; must be finite
-- expect: 7: links[1].at[3]: value inf; must be finite
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, at = { 0, 0/0, 1/0 }, mass = 1 },
  },
}
