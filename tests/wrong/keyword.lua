-- expect: 6: parameter double: a reserved word of C or C++; choose another name
-- expect: 10: link for: a reserved word of C or C++; choose another name
-- expect: 11: link "2nd": not an identifier of C; use a letter, then letters, digits and _
-- expect: 12: link ground: the name of the fixed frame; choose another name
local rd = require "refdyn"
local p = rd.parameters { { "double", 1 } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "for", joint = { "x" }, mass = 1 },
    { "2nd", on = "for", mass = 1 },
    { "ground", on = "for", mass = 1 },
  },
}
