-- expect: 0: a text of more than 4 MB; texts must be shorter
-- Tries texts of texts of texts.
local rd = require "refdyn"
local s = "x"
for i = 1, 40 do s = s:rep(10) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
