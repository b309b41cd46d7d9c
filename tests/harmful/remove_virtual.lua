-- expect: 5: table.remove: the table has __len; must be a table without it
-- Tries to remove an entry from the front of a list that claims 10^12 entries.
local rd = require "refdyn"
local t = setmetatable({}, { __len = function() return 10^12 // 1 | 0 end })
table.remove(t, 1)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
