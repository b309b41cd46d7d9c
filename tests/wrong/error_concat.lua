-- expect: 3: invalid value (table) at index 2 in table for 'concat'
local rd = require "refdyn"
local s = table.concat({ 1, {}, 3 })
