-- expect: 4: text "a\u{2028}b": contains control character 8232; remove it
-- expect: 4: text "a\u{85}b": contains control character 133; remove it
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "a\u{2028}b" }, { "n", 1, "a\u{85}b" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
